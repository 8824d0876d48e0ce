#pragma once

#include <array>
#include <string>
#include <vector>

#include "pipeline/config.hpp"

namespace ipl_slam {

/// Settings that a benchmark runs under one name: a preset and what differs from it.
struct BenchmarkConfiguration {
  std::string name;                    ///< also that of its folder
  std::string preset;                  ///< "default" or "paper"
  std::vector<std::string> overrides;  ///< "KEY=VALUE"
  bool realtime = false;
};

/// One column of the paper's Table 3.
struct Ablation {
  const char* suffix;  ///< of the configuration's name; empty for the preset as it is
  std::vector<std::string> overrides;
};

/// The four columns of Table 3: segmentation only, + lines, + motion consistency, + lines + adaptive weights.
[[nodiscard]] const std::array<Ablation, 4>& ablations();

/// A preset as it is, in lockstep.
[[nodiscard]] BenchmarkConfiguration lockstep_configuration(const std::string& preset);
/// The same at recorded speed.
[[nodiscard]] BenchmarkConfiguration realtime_configuration(const std::string& preset);
/// One column of Table 3 for a preset, in lockstep. That of no overrides is the lockstep configuration.
[[nodiscard]] BenchmarkConfiguration ablation_configuration(const std::string& preset,
                                                            const Ablation& ablation);

/// What makes run k of a configuration differ from the others. Runs in lockstep repeat each other to the
/// byte, which says nothing of how much of a result is luck: from the second run on, grey values get a noise
/// of one step (features.noise), from a seed of its own (schedule.seed). Run 0 is the undisturbed one. In
/// realtime timing makes spread enough.
[[nodiscard]] std::vector<std::string> run_overrides(const BenchmarkConfiguration& configuration, int run);

}  // namespace ipl_slam
