#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "dense/dense_map.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam::cli {

/// What is written of a dense map besides cloud.ply and objects.json, as asked for on the command line.
struct CloudOutputs {
  bool label_colors = false;
  bool pcd = false, mesh = false, occupancy = false, octomap = false;

  void add_to(CLI::App& verb);
  /// Whether any of these options was given.
  [[nodiscard]] bool any() const { return label_colors || pcd || mesh || occupancy || octomap; }
  /// Writes the files into a folder and returns their names. Throws UserError.
  std::vector<std::string> write(const std::filesystem::path& folder, const DenseMap::Result& fused,
                                 const DenseMap& dense) const;
  /// Every name that write() may use.
  [[nodiscard]] static std::vector<std::string> all_names();
};

}  // namespace ipl_slam::cli
