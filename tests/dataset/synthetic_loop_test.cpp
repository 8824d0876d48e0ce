#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/synthetic/camera_path.hpp"
#include "dataset/synthetic/renderer.hpp"
#include "dataset/synthetic/synthetic_source.hpp"

// The scenes in which a camera comes back to where it began.
namespace ipl_slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFps = 15.0;

SyntheticOptions round_trip(const std::string& scene, int people = 0, std::uint64_t seed = 1) {
  SyntheticOptions options;
  options.scene = scene;
  options.trajectory = "loop";
  options.seed = seed;
  options.people = people;
  options.width = 80;
  options.height = 60;
  options.fps = kFps;
  options.frames = scene == "building" ? 1290 : 1200;  // a whole round and 5 m of the next
  options.color_noise = options.depth_noise = false;
  return options;
}

// Scenes are painted once: that takes longer than all that is asked of them.
const SyntheticSource& source_of(const std::string& scene, int people, std::uint64_t seed) {
  static std::map<std::string, std::unique_ptr<SyntheticSource>> sources;
  std::unique_ptr<SyntheticSource>& source =
      sources[scene + std::to_string(people) + "/" + std::to_string(seed)];
  if (!source) source = std::make_unique<SyntheticSource>(round_trip(scene, people, seed));
  return *source;
}

double heading(const SE3& T_wc) {
  const Vector3d ahead = T_wc.rotation_matrix().col(2);
  return std::atan2(ahead.y(), ahead.x());
}

// Distance of a point from a solid that stands still.
double distance(const synthetic::Primitive& p, const Vector3d& point) {
  const Vector3d local = p.T_fp.inverse() * point;
  if (p.shape == synthetic::Shape::Box) return (local.cwiseAbs() - p.size).cwiseMax(0.0).norm();
  const double end = std::clamp(local.z(), -p.size.z(), p.size.z());
  return std::max(0.0, (local - Vector3d(0, 0, end)).norm() - std::max(p.size.x(), p.size.y()));
}

// Free floor about someone upright: the smallest distance of a vertical line from all that stands still.
double clearance(const synthetic::Scene& scene, const Vector2d& at, double from, double to) {
  double nearest = 1e9;
  for (const synthetic::Primitive& p : scene.primitives) {
    if (p.frame != 0) continue;
    for (double z = from; z <= to; z += 0.1) {
      nearest = std::min(nearest, distance(p, {at.x(), at.y(), z}));
    }
  }
  return nearest;
}

std::vector<Vector2d> people_at(const SyntheticSource& source, double time) {
  const std::vector<SE3> frames = source.scene().frames(time);
  std::vector<Vector2d> people;
  for (const synthetic::SceneObject& object : source.scene().objects) {
    if (object.class_name == "person")
      people.emplace_back(frames[object.first_frame].translation().head<2>());
  }
  return people;
}

class RoundTrip : public testing::TestWithParam<std::string> {
 protected:
  const SyntheticSource& source(int people = 0, std::uint64_t seed = 1) {
    return source_of(GetParam(), people, seed);
  }
};

TEST_P(RoundTrip, IsSixtyMetresLongAndComesBackToItsBeginning) {
  const SyntheticSource& s = source();
  const double lap = s.scene().site.loop.lap_time();
  double length = 0.0;
  double overlap = 0.0;
  for (std::size_t i = 1; i < s.size(); ++i) {
    const double step = (s.T_wc(i).translation() - s.T_wc(i - 1).translation()).head<2>().norm();
    (s.timestamp(i) <= lap ? length : overlap) += step;
    if (s.timestamp(i) <= lap) continue;
    const SE3 before = synthetic::camera_pose("loop", s.scene().site, s.timestamp(i) - lap);
    // Swaying (6 cm, to either side) and looking about (9 degrees) are not the same again.
    EXPECT_LT((s.T_wc(i).translation() - before.translation()).norm(), 0.16);
    EXPECT_LT(std::abs(std::remainder(heading(s.T_wc(i)) - heading(before), 2 * std::numbers::pi)), 0.36);
  }
  EXPECT_GE(length, 60.0);
  EXPECT_GE(overlap, 5.0);
}

TEST_P(RoundTrip, IsTheSameWhateverTheNumberOfFrames) {
  const SyntheticSource& s = source();
  SyntheticOptions options = round_trip(GetParam());
  options.fps = 2 * kFps;
  options.frames = 100;
  const SyntheticSource faster(options);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_LT((s.T_wc(i).inverse() * faster.T_wc(2 * i)).translation().norm(), 1e-5);  // rounded times
  }
}

TEST_P(RoundTrip, IsWalkedSmoothly) {
  const synthetic::CameraSite& site = source().scene().site;
  constexpr double kStep = 0.02;
  SE3 before = synthetic::camera_pose("loop", site, 0.0);
  double speed_before = -1.0;
  for (double t = kStep; t < site.loop.lap_time(); t += kStep) {
    const SE3 now = synthetic::camera_pose("loop", site, t);
    const SE3 motion = before.inverse() * now;
    const double speed = motion.translation().norm() / kStep;
    ASSERT_LT(speed, 1.0) << "at " << t;
    ASSERT_GT(speed, 0.4) << "at " << t;
    ASSERT_LT(motion.angle() / kStep * 180.0 / std::numbers::pi, 60.0) << "at " << t;
    if (speed_before >= 0.0) {
      ASSERT_LT(std::abs(speed - speed_before) / kStep, 1.0) << "at " << t;  // m/s^2
    }
    speed_before = speed;
    before = now;
  }
}

TEST_P(RoundTrip, KeepsClearOfWallsAndFurniture) {
  for (const std::uint64_t seed : {1, 2}) {
    const SyntheticSource& s = source(0, seed);
    for (std::size_t i = 0; i < s.size(); i += 3) {
      const Vector2d at = s.T_wc(i).translation().head<2>();
      // 0.3 m: half the width of a man, and what the camera sways by.
      ASSERT_GT(clearance(s.scene(), at, 0.35, 1.75), 0.3) << "seed " << seed << " frame " << i;
    }
  }
}

TEST_P(RoundTrip, HasSurfacesWithinReachOfTheDepthCameraEverywhere) {
  const SyntheticSource& s = source();
  for (std::size_t i = 0; i < s.size(); i += 60) {
    const cv::Mat depth = s.render(i).true_depth;
    const double share = cv::countNonZero((depth > 0.4) & (depth < s.options().depth_sensor.max_range)) /
                         static_cast<double>(depth.total());
    EXPECT_GT(share, 0.7) << "frame " << i;
  }
}

TEST_P(RoundTrip, PeopleAreSeenMostOfTheTimeAndAreInNobodysWay) {
  const SyntheticSource& s = source(8);
  int seen = 0;
  int looked = 0;
  for (std::size_t i = 0; i < s.size(); i += 5) {
    const double time = s.timestamp(i);
    const Vector2d eye = s.T_wc(i).translation().head<2>();
    const std::vector<Vector2d> people = people_at(s, time);
    ASSERT_EQ(people.size(), 8U);
    for (std::size_t a = 0; a < people.size(); ++a) {
      ASSERT_GT((people[a] - eye).norm(), 0.55) << "person " << a << " frame " << i;
      ASSERT_GT(clearance(s.scene(), people[a], 0.4, 1.7), 0.2) << "person " << a << " frame " << i;
      for (std::size_t b = 0; b < a; ++b) {
        ASSERT_GT((people[a] - people[b]).norm(), 0.4) << "people " << a << ", " << b << " frame " << i;
      }
    }
    if (i % 30 != 0) continue;
    const cv::Mat mask = s.render(i).mask;
    int pixels = 0;
    for (const SyntheticObject& object : s.objects()) {
      if (object.class_name == "person") pixels += cv::countNonZero(mask == object.id);
    }
    ++looked;
    if (pixels > 0.02 * static_cast<double>(mask.total())) ++seen;
  }
  EXPECT_GT(seen, 0.8 * looked);
}

TEST_P(RoundTrip, ObjectsHaveNumbersThatFitIntoAMask) {
  EXPECT_LE(source(8).objects().size(), 255U);
}

TEST_P(RoundTrip, PicturesFollowFromTheSeedAlone) {
  const SyntheticFrame one = source(8).render(300);
  const SyntheticFrame again = SyntheticSource(round_trip(GetParam(), 8), 3).render(300);
  EXPECT_EQ(cv::norm(one.rgbd.color, again.rgbd.color, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(one.rgbd.depth, again.rgbd.depth, cv::NORM_INF), 0.0);
  const SyntheticFrame other = source(0, 2).render(300);
  EXPECT_GT(cv::norm(one.rgbd.color, other.rgbd.color, cv::NORM_L1) / static_cast<double>(one.mask.total()),
            3.0);
}

TEST_P(RoundTrip, RefusesWhatItHasNoRoomFor) {
  SyntheticOptions options = round_trip(GetParam());
  options.trajectory = "walk";
  EXPECT_THROW(options.check(), UserError);
  options.trajectory = "loop";
  EXPECT_NO_THROW(options.check());
  options.boxes = 1;
  EXPECT_THROW(options.check(), UserError);
  options.boxes = 0;
  options.scene = "room";
  EXPECT_THROW(options.check(), UserError);
}

INSTANTIATE_TEST_SUITE_P(Synthetic, RoundTrip, testing::Values("building", "doors"),
                         [](const auto& info) { return info.param; });

// Share of a picture that is the same, within a few grey values, from another place, where the camera is
// turned by so many radians.
double alike(const SyntheticSource& source, const Vector3d& from, const Vector3d& to, double turn = 0.0) {
  const Vector3d ahead(4.0, 0.6, -0.4);
  const Vector3d turned = Eigen::AngleAxisd(turn, Vector3d::UnitZ()) * ahead;
  synthetic::RenderedImages a, b;
  synthetic::render(source.scene(), source.camera(), synthetic::look_at(from, from + ahead), 0.0, 1, a);
  synthetic::render(source.scene(), source.camera(), synthetic::look_at(to, to + turned), 0.0, 1, b);
  cv::Mat difference, channels[3];
  cv::absdiff(a.color, b.color, difference);
  cv::split(difference, channels);
  const cv::Mat most = cv::max(cv::max(channels[0], channels[1]), channels[2]);
  return cv::countNonZero(most < 12.0) / static_cast<double>(most.total());
}

TEST(SyntheticDoors, LookNearlyTheSameFromDoorToDoorAndRoomsDoNot) {
  const SyntheticSource& doors = source_of("doors", 0, 1);
  const double next_door = alike(doors, {-6.0, -6.0, 1.45}, {-3.0, -6.0, 1.45});
  EXPECT_GT(next_door, 0.75);
  EXPECT_LT(next_door, 0.995);  // stains and the end of the corridor differ
  EXPECT_GT(alike(doors, {-6.0, -6.0, 1.45}, {6.0, 6.0, 1.45}, std::numbers::pi), 0.5);  // across the ring
  EXPECT_LT(alike(doors, {-6.0, -6.0, 1.45}, {-4.6, -6.0, 1.45}), 0.6);                  // between two doors
  EXPECT_LT(alike(source_of("building", 0, 1), {-7.0, -6.5, 1.45}, {0.0, -6.5, 1.45}), 0.4);
}

}  // namespace
}  // namespace ipl_slam
