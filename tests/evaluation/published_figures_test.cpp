#include "evaluation/published_figures.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

std::string published_name(std::string_view folder) {
  const PublishedSequence* found = find_published(folder);
  return found ? found->name : "";
}

TEST(PublishedFigures, AreFoundByTheUsualNames) {
  EXPECT_EQ(published_name("rgbd_dataset_freiburg3_walking_xyz"), "fr3/walking_xyz");
  EXPECT_EQ(published_name("fr3_walking_xyz"), "fr3/walking_xyz");
  EXPECT_EQ(published_name("FR3-w-rpy"), "fr3/walking_rpy");
  EXPECT_EQ(published_name("fr3_w_half"), "fr3/walking_halfsphere");
  EXPECT_EQ(published_name("rgbd_dataset_freiburg3_sitting_rpy"), "fr3/sitting_rpy");
}

TEST(PublishedFigures, AreNotThoseOfAnotherSequenceOrAPart) {
  for (const char* name : {"fr3_walking_halfsphere_49", "rgbd_dataset_freiburg3_walking_xyz_validation",
                           "fr1_xyz_walking", "fr3_sitting_xyz", "fr2_walking_xyz", "walking_xyz", ""}) {
    EXPECT_EQ(published_name(name), "") << name;
  }
}

TEST(PublishedFigures, KnowTheBestOfEachKind) {
  const auto rmse = [](const PublishedAte& a) { return std::optional(a.rmse); };
  const auto median = [](const PublishedAte& a) { return a.median; };
  const auto nothing = [](const PublishedAte&) { return std::optional<double>(); };
  EXPECT_EQ(best_published(*find_published("fr3_walking_xyz"), rmse), 0.0129);
  EXPECT_EQ(best_published(*find_published("fr3_walking_rpy"), rmse), 0.0310);
  EXPECT_EQ(best_published(*find_published("fr3_walking_halfsphere"), rmse), 0.0237);
  EXPECT_EQ(best_published(*find_published("fr3_walking_static"), rmse), 0.0065);
  EXPECT_EQ(best_published(*find_published("fr3_sitting_rpy"), rmse), 0.0198);
  EXPECT_EQ(best_published(*find_published("fr3_walking_static"), median), 0.0063);
  EXPECT_FALSE(best_published(*find_published("fr3_walking_static"), nothing));
}

// A slip of the pen in the tables would mostly break one of these.
TEST(PublishedFigures, AgreeWithEachOther) {
  for (const PublishedSequence& sequence : published_sequences()) {
    EXPECT_EQ(find_published(sequence.name), &sequence);
    for (const PublishedAte& a : sequence.ate) {
      if (!a.mean) continue;
      // rmse^2 = mean^2 + std^2 holds in the paper to some per cent only, but no part exceeds the whole.
      for (const std::optional<double>& part : {a.mean, a.median, a.std}) {
        EXPECT_LT(*part, a.rmse) << sequence.name << ' ' << a.system;
      }
    }
    // The full system of the ablation is the one of Tables 1 and 2.
    if (sequence.ablation) {
      EXPECT_NEAR(sequence.ablation->back(), sequence.ate.back().rmse, 1e-4);
    }
  }
}

}  // namespace
}  // namespace ipl_slam
