#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "dataset/tum_dataset.hpp"
#include "geometry/camera.hpp"
#include "pipeline/config.hpp"

namespace ipl_slam::cli {

/// Refuses an empty word where a path is wanted.
[[nodiscard]] CLI::Validator not_empty();

/// The options of every verb that runs the system on a sequence, and what they stand for.
struct SequenceOptions {
  std::filesystem::path folder;
  std::string camera;
  std::string preset = "default";
  std::string config_file;
  std::vector<std::string> settings;
  TumDatasetOptions dataset;
  std::size_t max_frames = 0;

  /// `folder_meaning`: what the positional argument is.
  void add_to(CLI::App& verb, const std::string& folder_meaning =
                                  "Folder in TUM RGB-D layout: rgb.txt and depth.txt, or associations.txt");
  /// The part of them that does not depend on the sequence: --config and --set.
  void add_settings_to(CLI::App& verb);
  void add_max_frames_to(CLI::App& verb);
  /// The camera asked for, or the one guessed from the folder; prints which.
  [[nodiscard]] Camera load_camera() const;
  /// What to read, with an associations file that was given relative to the present folder made absolute.
  [[nodiscard]] TumDatasetOptions dataset_options() const;
  /// Throws UserError where results would go into the sequence itself, or take its place.
  void check_output(const std::filesystem::path& output) const;
  /// Preset, then the file, then the single settings.
  [[nodiscard]] Config load_config() const;
};

/// Throws UserError where an input folder is one that a run takes away from its output folder
/// (RUN_DIR/keyframes).
void check_kept(const std::filesystem::path& input, const std::filesystem::path& output);

}  // namespace ipl_slam::cli
