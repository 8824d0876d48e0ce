#pragma once

#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

#include "pipeline/config.hpp"

namespace ipl_slam::cli {

/// Which segmenter a verb uses, as asked for on the command line.
struct SegmenterChoice {
  std::string segmenter;  ///< empty = as the settings say
  std::filesystem::path model, masks;

  void add_to(CLI::App& verb);
  /// Puts the choice, and the model named by the environment variable IPL_SLAM_MODEL where none is, into the
  /// settings. "auto" is resolved. Returns what was chosen, for people. Throws UserError where the options
  /// contradict each other.
  std::string resolve(Config& config) const;
  /// The same, and prints it.
  void apply(Config& config) const;
};

}  // namespace ipl_slam::cli
