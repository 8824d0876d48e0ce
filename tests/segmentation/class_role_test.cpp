#include "segmentation/class_role.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

TEST(ClassRole, PeopleAnimalsAndVehiclesMoveByThemselves) {
  for (const char* name : {"person", "dog", "giraffe", "car", "bicycle", "boat"}) {
    EXPECT_EQ(class_role(name), ClassRole::likely_mover) << name;
  }
}

TEST(ClassRole, WhatIsCarriedOrPushedIsMovable) {
  for (const char* name : {"chair", "book", "sports ball", "cup", "bottle", "backpack", "suitcase", "laptop",
                           "keyboard", "teddy bear"}) {
    EXPECT_EQ(class_role(name), ClassRole::movable) << name;
  }
}

TEST(ClassRole, FurnitureAndStreetFurnitureIsBackground) {
  for (const char* name : {"bed", "couch", "sink", "traffic light", "dining table"}) {
    EXPECT_EQ(class_role(name), ClassRole::background) << name;
  }
}

TEST(ClassRole, WhatNobodyKnowsIsMovable) {
  EXPECT_EQ(class_role("unknown"), ClassRole::movable);
  EXPECT_EQ(class_role(""), ClassRole::movable);
}

}  // namespace
}  // namespace ipl_slam
