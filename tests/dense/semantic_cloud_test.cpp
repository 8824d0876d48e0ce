#include "dense/semantic_cloud.hpp"

#include <algorithm>
#include <cstdlib>
#include <set>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

TEST(ClassLabels, AreCocosNumbersAndGoOnBehindThem) {
  ClassLabels labels;
  EXPECT_EQ(labels.label("person"), 0);
  EXPECT_EQ(labels.label("chair"), 56);
  EXPECT_EQ(labels.label("forklift"), 80);
  EXPECT_EQ(labels.label("pallet"), 81);
  EXPECT_EQ(labels.label("forklift"), 80);
  EXPECT_EQ(labels.name(56), "chair");
  EXPECT_EQ(labels.name(81), "pallet");
}

TEST(ClassColors, DifferFromEachOther) {
  std::set<Rgb> colors;
  for (int label = 0; label < 100; ++label) colors.insert(class_color(label));
  EXPECT_EQ(colors.size(), 100U);
}

}  // namespace
}  // namespace ipl_slam
