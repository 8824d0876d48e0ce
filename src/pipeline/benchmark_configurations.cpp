#include "pipeline/benchmark_configurations.hpp"

#include <fmt/format.h>

namespace ipl_slam {

const std::array<Ablation, 4>& ablations() {
  static const std::array<Ablation, 4> columns = {{
      {"-segmentation-only",
       {"features.lines=off", "dynamics.points.check=off", "dynamics.lines.check=off",
        "dynamics.weights=off"}},
      {"-lines", {"dynamics.points.check=off", "dynamics.lines.check=off", "dynamics.weights=off"}},
      {"-motion", {"features.lines=off", "dynamics.weights=off"}},
      {"", {}},
  }};
  return columns;
}

BenchmarkConfiguration lockstep_configuration(const std::string& preset) {
  return {preset, preset, {"schedule.mode=lockstep"}, false};
}

BenchmarkConfiguration realtime_configuration(const std::string& preset) {
  return {preset + "-realtime", preset, {"schedule.mode=realtime"}, true};
}

BenchmarkConfiguration ablation_configuration(const std::string& preset, const Ablation& ablation) {
  BenchmarkConfiguration configuration = lockstep_configuration(preset);
  configuration.name += ablation.suffix;
  configuration.overrides.insert(configuration.overrides.end(), ablation.overrides.begin(),
                                 ablation.overrides.end());
  return configuration;
}

std::vector<std::string> run_overrides(const BenchmarkConfiguration& configuration, int run) {
  if (configuration.realtime || run == 0) return {};
  return {fmt::format("schedule.seed={}", run), "features.noise=1"};
}

}  // namespace ipl_slam
