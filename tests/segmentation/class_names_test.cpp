#include "segmentation/class_names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(ParseClassNames, ReadsWhatUltralyticsWrites) {
  EXPECT_THAT(parse_class_names("{0: 'person', 1: 'traffic light'}"), ElementsAre("person", "traffic light"));
  EXPECT_THAT(parse_class_names("{0: \"driver's seat\", 1: 'a \\'b\\' \\\\ c'}"),
              ElementsAre("driver's seat", "a 'b' \\ c"));
}

TEST(ParseClassNames, GivesNothingForOtherTexts) {
  for (const char* text : {"", "{}", "person", "{0: 'person'", "{0: person}", "{1: 'person'}",
                           "{0: 'a', 2: 'b'}", "{0: 'a' 1: 'b'}", "{0: 'a", "{99999999999999999999: 'a'}"}) {
    EXPECT_THAT(parse_class_names(text), IsEmpty()) << text;
  }
}

TEST(ClassNames, ComeFromTheModelThenFromCocoThenFromTheirNumber) {
  EXPECT_THAT(class_names("{0: 'box', 1: 'door'}", 2), ElementsAre("box", "door"));
  EXPECT_EQ(class_names("", 80), coco_class_names());
  EXPECT_EQ(coco_class_names().size(), 80U);
  EXPECT_EQ(coco_class_names()[56], "chair");
  EXPECT_THAT(class_names("{0: 'box'}", 2), ElementsAre("class 0", "class 1"));
}

TEST(SelectClasses, TakesAllForAnEmptyList) {
  for (const char* list : {"", " ", ",", " , ,"}) {
    EXPECT_THAT(select_classes(list, {"a", "b"}), ElementsAre(true, true)) << "'" << list << "'";
  }
}

TEST(SelectClasses, TakesNamesSeparatedByCommas) {
  EXPECT_THAT(select_classes("traffic light , cat", {"cat", "dog", "traffic light"}),
              ElementsAre(true, false, true));
}

TEST(SelectClasses, LeavesOutEmptyItems) {
  for (const char* list : {"cat,", ",cat", "cat,,cat ,"}) {
    EXPECT_THAT(select_classes(list, {"cat", "dog"}), ElementsAre(true, false)) << "'" << list << "'";
  }
}

TEST(SelectClasses, NamesTheNearestOfAMistypedOne) {
  try {
    (void)select_classes("person,brid", coco_class_names());
    FAIL() << "'brid' was taken";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), HasSubstr("'brid'; did you mean 'bird'"));
  }
}

}  // namespace
}  // namespace ipl_slam
