#include "pipeline/benchmark_configurations.hpp"

#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace ipl_slam {
namespace {

Config config_of(const BenchmarkConfiguration& configuration, int run) {
  Config config = preset(configuration.preset);
  for (const std::string& setting : configuration.overrides) set_option(config, setting);
  for (const std::string& setting : run_overrides(configuration, run)) set_option(config, setting);
  check(config);
  return config;
}

TEST(BenchmarkConfigurations, RunsInLockstepDifferInSeedAndNoiseOnly) {
  const BenchmarkConfiguration lockstep = lockstep_configuration("paper");
  Config first = config_of(lockstep, 0), third = config_of(lockstep, 2), plain = preset("paper");
  EXPECT_EQ(options_json(option_table(first)), options_json(option_table(plain))) << "run 0 is undisturbed";
  EXPECT_EQ(third.schedule.seed, 2u);
  EXPECT_EQ(third.features.noise, 1.0);
  third.schedule.seed = plain.schedule.seed;
  third.features.noise = plain.features.noise;
  EXPECT_EQ(options_json(option_table(third)), options_json(option_table(plain)));
}

TEST(BenchmarkConfigurations, InRealtimeTheInputIsUndisturbed) {
  const Config config = config_of(realtime_configuration("default"), 3);
  EXPECT_EQ(config.schedule.mode, "realtime");
  EXPECT_EQ(config.features.noise, 0.0);
}

TEST(BenchmarkConfigurations, OfTheAblationHaveNamesOfTheirOwnAndEndWithThePreset) {
  std::set<std::string> names;
  for (const Ablation& ablation : ablations()) names.insert(ablation_configuration("paper", ablation).name);
  EXPECT_EQ(names.size(), 4u);
  EXPECT_EQ(ablation_configuration("paper", ablations().back()).name, lockstep_configuration("paper").name);
  EXPECT_TRUE(ablations().back().overrides.empty());
}

TEST(BenchmarkConfigurations, OfTheAblationCanBeSet) {
  for (const std::string& name : preset_names()) {
    std::set<std::string> different;
    for (const Ablation& ablation : ablations()) {
      Config changed = config_of(ablation_configuration(name, ablation), 0);
      different.insert(options_json(option_table(changed)).dump());
    }
    EXPECT_EQ(different.size(), 4u) << "two columns of " << name << " are the same";
  }
}

}  // namespace
}  // namespace ipl_slam
