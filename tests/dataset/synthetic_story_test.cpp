// Stories told before the camera: what happens is what was asked for, and what is said of it is true.

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/synthetic/camera_path.hpp"
#include "dataset/synthetic/synthetic_source.hpp"

namespace ipl_slam {
namespace {

SyntheticOptions story(const char* name, int people = 4) {
  SyntheticOptions options;
  options.width = 160;
  options.height = 120;
  options.frames = 150;
  options.fps = 15.0;
  options.trajectory = "halfsphere";
  options.story = name;
  options.people = people;
  options.boxes = options.story == "push" ? 1 : 0;
  return options;
}

std::vector<SyntheticObject> of_class(const SyntheticSource& source, const std::string& name) {
  std::vector<SyntheticObject> found;
  for (const SyntheticObject& object : source.objects()) {
    if (object.class_name == name) found.push_back(object);
  }
  return found;
}

// Share of the picture that people cover.
double covered(const SyntheticSource& source, std::size_t frame) {
  const cv::Mat mask = source.instance_mask(frame);
  int pixels = 0;
  for (const SyntheticObject& person : of_class(source, "person")) {
    pixels += cv::countNonZero(mask == person.id);
  }
  return pixels / static_cast<double>(mask.total());
}

TEST(SyntheticStory, StandingPeopleNeverMoveAndCoverHalfOfThePicture) {
  const SyntheticSource source(story("stand"));
  for (const SyntheticObject& person : of_class(source, "person")) {
    EXPECT_FALSE(person.moving);
    EXPECT_TRUE(person.moving_frames.empty());
  }
  EXPECT_GT(covered(source, 0), 0.5);
}

TEST(SyntheticStory, ACrowdIsAlwaysOnItsWayAndCoversMoreThanSixtyPercent) {
  const SyntheticSource source(story("crowd"));
  double sum = 0.0;
  for (std::size_t i = 0; i < source.size(); i += 3) sum += covered(source, i);
  EXPECT_GT(sum / (source.size() / 3.0), 0.6);
  for (const SyntheticObject& person : of_class(source, "person")) {
    ASSERT_EQ(person.moving_frames.size(), 1U);
    EXPECT_EQ(person.moving_frames.front(), std::pair(std::size_t{0}, source.size() - 1));
  }
}

TEST(SyntheticStory, PeopleEnterAnEmptyRoomAndStay) {
  const SyntheticSource source(story("enter"));
  EXPECT_EQ(covered(source, 0), 0.0);
  EXPECT_EQ(covered(source, source.size() / 4), 0.0) << "their cue";
  EXPECT_GT(covered(source, source.size() - 1), 0.5);
  for (const SyntheticObject& person : of_class(source, "person")) {
    EXPECT_FALSE(source.moves(person.id, 1)) << "waits";
    EXPECT_FALSE(source.moves(person.id, source.size() - 1)) << "has arrived";
    EXPECT_TRUE(person.moving);
  }
}

TEST(SyntheticStory, PeopleLeaveTheRoomEmpty) {
  const SyntheticSource source(story("leave"));
  EXPECT_GT(covered(source, source.size() / 4), 0.5) << "their cue";
  EXPECT_EQ(covered(source, source.size() - 1), 0.0);
}

TEST(SyntheticStory, TheBoxStandsStillForAThirdThenMovesSmoothly) {
  const SyntheticSource source(story("push", 0));
  std::vector<SyntheticObject> movers;
  for (const SyntheticObject& object : source.objects()) {
    if (object.moving) movers.push_back(object);
  }
  ASSERT_EQ(movers.size(), 1U);
  EXPECT_EQ(movers[0].class_name, "box");
  ASSERT_EQ(movers[0].moving_frames.size(), 1U);
  EXPECT_EQ(movers[0].moving_frames[0].first, source.size() / 3 + 1) << "the first frame after the start";
  EXPECT_EQ(movers[0].moving_frames[0].second, source.size() - 1);
  const double pixels = cv::countNonZero(source.instance_mask(0) == movers[0].id);
  EXPECT_GT(pixels, 0.15 * 160 * 120) << "a big one";
  const int frame = source.scene().objects[movers[0].id - 1].first_frame;
  const auto at = [&](std::size_t i) -> Eigen::Vector3d {
    return source.scene().frames(source.timestamp(i))[frame].translation();
  };
  double farthest = 0.0;
  for (std::size_t i = 2; i < source.size(); ++i) {
    const Eigen::Vector3d step = at(i) - at(i - 1), step_before = at(i - 1) - at(i - 2);
    EXPECT_LT(step.norm() * 15.0, 0.4) << "m/s";
    EXPECT_LT((step - step_before).norm() * 15.0 * 15.0, 0.6) << "m/s^2";
    farthest = std::max(farthest, (at(i) - at(0)).norm());
  }
  EXPECT_GT(farthest, 0.6);
}

// Bodies are 0.25 m wide to either side and walk past each other sideways on.
TEST(SyntheticStory, PeopleAreNeverInEachOthersNorInTheCamerasWay) {
  for (const char* name : {"stand", "crowd", "enter", "leave"}) {
    SyntheticOptions options = story(name);
    options.frames = 300;
    const SyntheticSource source(options);
    for (std::size_t i = 0; i < source.size(); ++i) {
      const double time = source.timestamp(i);
      const std::vector<SE3> frames = source.scene().frames(time);
      std::vector<Eigen::Vector2d> places;
      for (const SyntheticObject& person : of_class(source, "person")) {
        const int pelvis = source.scene().objects[person.id - 1].first_frame;
        places.emplace_back(frames[pelvis].translation().head<2>());
      }
      ASSERT_EQ(places.size(), 4U);
      for (std::size_t a = 0; a < places.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
          ASSERT_GT((places[a] - places[b]).norm(), 0.5) << name << ", frame " << i;
        }
        for (const char* path : {"xyz", "rpy", "halfsphere", "static"}) {
          const Eigen::Vector3d eye = synthetic::camera_pose(path, source.scene().site, time).translation();
          ASSERT_GT((places[a] - eye.head<2>()).norm(), 0.45) << name << ", " << path << ", frame " << i;
        }
      }
    }
  }
}

TEST(SyntheticStory, PrintedClothesAreFullOfCornersAndPlainOnesAreNot) {
  const auto corners_on_people = [](const char* clothes) {
    SyntheticOptions options = story("stand");
    options.width = 320;
    options.height = 240;
    options.clothes = clothes;
    options.color_noise = false;
    const SyntheticSource source(options);
    const SyntheticFrame frame = source.render(0);
    cv::Mat inside = cv::Mat::zeros(frame.mask.size(), CV_8UC1);
    for (const SyntheticObject& person : of_class(source, "person")) {
      inside.setTo(255, frame.mask == person.id);
    }
    std::vector<cv::KeyPoint> corners;
    cv::FAST(frame.rgbd.color, corners, 20);
    return std::count_if(corners.begin(), corners.end(),
                         [&](const cv::KeyPoint& c) { return inside.at<std::uint8_t>(c.pt) != 0; });
  };
  EXPECT_GT(corners_on_people("printed"), 500);
  EXPECT_GT(corners_on_people("printed"), 5 * corners_on_people("plain"));
}

TEST(SyntheticStory, TheTurningCameraDoesNotShift) {
  SyntheticOptions options = story("walk", 0);
  options.trajectory = "rpy";
  const SyntheticSource source(options);
  double turned = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    EXPECT_LT((source.T_wc(i).translation() - source.T_wc(0).translation()).norm(), 1e-12);
    turned = std::max(turned, (source.T_wc(0).inverse() * source.T_wc(i)).angle());
  }
  EXPECT_GT(turned, 0.2);
}

TEST(SyntheticStory, RefusesWhatTheStageHasNoRoomFor) {
  for (const char* trajectory : {"orbit", "sweep", "walk"}) {
    SyntheticOptions options = story("stand");
    options.trajectory = trajectory;
    EXPECT_THROW(SyntheticSource{options}, UserError) << trajectory;
  }
  for (const int people : {0, 5}) EXPECT_THROW(SyntheticSource{story("crowd", people)}, UserError) << people;
  SyntheticOptions boxless = story("push", 0);
  boxless.boxes = 0;
  EXPECT_THROW(SyntheticSource{boxless}, UserError);
  SyntheticOptions elsewhere = story("stand");
  elsewhere.scene = "white_room";
  EXPECT_THROW(SyntheticSource{elsewhere}, UserError);
  EXPECT_THROW(SyntheticSource{story("opera")}, UserError);
}

}  // namespace
}  // namespace ipl_slam
