#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "dataset/trajectory.hpp"
#include "dense/dense_map.hpp"

namespace ipl_slam::cli {

/// What is written of a dense map besides cloud.ply and objects.json, as asked for on the command line.
struct CloudOutputs {
  bool label_colors = false;
  bool pcd = false, mesh = false, occupancy = false, octomap = false;

  void add_to(CLI::App& verb);
  /// Whether any of these options was given.
  [[nodiscard]] bool any() const { return label_colors || pcd || mesh || occupancy || octomap; }
  /// Throws UserError where this build cannot write what is asked for.
  void check() const;
  /// Writes the files into a folder and returns their names. trajectory: of the cameras, in the cloud's
  /// world; tells where up is. Throws UserError.
  std::vector<std::string> write(const std::filesystem::path& folder, const DenseMap::Result& fused,
                                 const DenseMap& dense, const Trajectory& trajectory) const;
  /// Takes away whatever an earlier write() left.
  static void clear(const std::filesystem::path& folder);
};

}  // namespace ipl_slam::cli
