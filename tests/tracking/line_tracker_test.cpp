#include "tracking/line_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "support/line_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Pixels. The samples at both ends of a line lie at corners, which are round, and shifted where they are not
// square in the image; along the middle an edge is exact but for grey values being whole numbers.
constexpr double kNearEnds = 0.4, kNearMiddle = 0.1;

LineTrackerOptions options() {
  LineTrackerOptions result;
  result.max_lines = 1000;
  result.min_length = 20.0;
  return result;
}

// One keyframe of a world of rectangles, as a local map.
struct Scene {
  explicit Scene(const Camera& camera = kTestCamera) : world(camera), view(world.look(T_cw)) {
    map.add(view);
    local = map.snapshot();
    grey = world.image(T_cw);
  }
  [[nodiscard]] LineSights look(const LineTrackerOptions& tracker_options, const SE3& from,
                                double radius) const {
    return LineTracker(world.camera(), tracker_options).look(grey, from, *local, radius);
  }
  // Image line of a line of the local map from where the image was taken.
  [[nodiscard]] ImageLine truth(int line) const {
    const LocalLine& l = local->lines[static_cast<std::size_t>(line)];
    return *image_line(project(l.start), project(l.end));
  }
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& p_w, const SE3& from) const {
    return world.camera().project(from * p_w);
  }
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& p_w) const { return project(p_w, T_cw); }
  [[nodiscard]] double length(const LocalLine& line) const {
    return (project(line.end) - project(line.start)).norm();
  }
  // What was found lies on the true line and runs the same way.
  void expect_right(const LineSights& sights) const {
    for (const LineSight& sight : sights.found) {
      const ImageLine line = truth(sight.line);
      EXPECT_LT(std::abs(signed_distance(line, sight.at.start)), kNearEnds) << "line " << sight.line;
      EXPECT_LT(std::abs(signed_distance(line, sight.at.end)), kNearEnds) << "line " << sight.line;
      const Eigen::Vector2d middle = 0.5 * (sight.at.start + sight.at.end);
      EXPECT_LT(std::abs(signed_distance(line, middle)), kNearMiddle) << "line " << sight.line;
      const LocalLine& l = local->lines[static_cast<std::size_t>(sight.line)];
      EXPECT_GT((sight.at.end - sight.at.start).dot(project(l.end) - project(l.start)), 0.0);
      EXPECT_GT((sight.at.end - sight.at.start).norm(), 0.5 * length(l)) << "most of it was there to be seen";
    }
  }

  const SE3 T_cw = camera_at({0.05, -0.02, 0.0}, 0.03, 0.02);
  LineWorld world;
  LineWorldMap map{world};
  LineView view;
  std::shared_ptr<const LocalMap> local;
  cv::Mat grey;
};

TEST(LineTracker, FindsAllLinesFromTheTruePose) {
  const Scene scene;
  const LineSights sights = scene.look(options(), scene.T_cw, 5.0);
  ASSERT_GT(scene.local->lines.size(), 50U);
  EXPECT_EQ(sights.visible.size(), scene.local->lines.size());
  EXPECT_EQ(sights.found.size(), sights.visible.size());
  scene.expect_right(sights);
}

TEST(LineTracker, FindsThemFromAPoseThatIsThreePixelsOff) {
  const Scene scene;
  const double angle = 3.0 / kTestCamera.fx;
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0)}) {
    const SE3 off = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)), Eigen::Vector3d::Zero());
    const LineSights sights = scene.look(options(), off * scene.T_cw, 5.0);
    // Nothing else lies within 15 pixels of an edge, so there is no reason to miss one.
    EXPECT_EQ(sights.found.size(), sights.visible.size());
    EXPECT_GT(sights.found.size(), 50U);
    scene.expect_right(sights);
  }
}

TEST(LineTracker, DoesNotLookFartherThanTheRadius) {
  const Scene scene;
  // All lines along v move by 8 pixels, those along u by none.
  const SE3 off = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(8.0 / kTestCamera.fx, Eigen::Vector3d::UnitY())),
                      Eigen::Vector3d::Zero());
  const LineSights narrow = scene.look(options(), off * scene.T_cw, 4.0),
                   wide = scene.look(options(), off * scene.T_cw, 12.0);
  const auto upright = [&](const LineSights& sights) {
    return std::count_if(sights.found.begin(), sights.found.end(), [&](const LineSight& s) {
      return std::abs(scene.truth(s.line).x()) > 0.9;  // the normal lies along u
    });
  };
  EXPECT_EQ(upright(narrow), 0);
  EXPECT_GT(upright(wide), 20);
  scene.expect_right(wide);
}

TEST(LineTracker, FindsLinesThatTheLensBends) {
  Camera camera = kTestCamera;
  camera.k1 = -0.15;
  const Scene scene(camera);
  const LineSights sights = scene.look(options(), scene.T_cw, 5.0);
  EXPECT_GT(sights.found.size(), 50U);
  EXPECT_EQ(sights.found.size(), sights.visible.size());
  scene.expect_right(sights);
}

TEST(LineTracker, WithoutAnImageThereIsNothing) {
  const Scene scene;
  const LineSights sights = LineTracker(kTestCamera, options()).look({}, scene.T_cw, *scene.local, 5.0);
  EXPECT_TRUE(sights.visible.empty()) << "not looked for, so nothing to be held against the lines";
  EXPECT_TRUE(sights.found.empty());
}

TEST(LineTracker, OnAnEvenWallTheLinesAreVisibleButNotFound) {
  const Scene scene;
  const cv::Mat wall(480, 640, CV_8UC1, cv::Scalar(90));
  const LineSights sights = LineTracker(kTestCamera, options()).look(wall, scene.T_cw, *scene.local, 5.0);
  EXPECT_EQ(sights.visible.size(), scene.local->lines.size());
  EXPECT_TRUE(sights.found.empty());
}

TEST(LineTracker, InANegativeTheBrighterSideIsTheWrongOne) {
  const Scene scene;
  const LineSights sights =
      LineTracker(kTestCamera, options()).look(255 - scene.grey, scene.T_cw, *scene.local, 5.0);
  EXPECT_EQ(sights.visible.size(), scene.local->lines.size());
  EXPECT_TRUE(sights.found.empty());
}

TEST(LineTracker, LooksForTheLongestWhereThereAreTooMany) {
  const Scene scene;
  LineTrackerOptions few = options();
  few.max_lines = 7;
  const LineSights sights = scene.look(few, scene.T_cw, 5.0);
  ASSERT_EQ(sights.visible.size(), 7U);
  const std::set<int> taken(sights.visible.begin(), sights.visible.end());
  ASSERT_EQ(taken.size(), 7U);
  double shortest_taken = 1e9, longest_left = 0.0;
  for (int i = 0; i < static_cast<int>(scene.local->lines.size()); ++i) {
    const double length = scene.length(scene.local->lines[static_cast<std::size_t>(i)]);
    if (taken.contains(i)) shortest_taken = std::min(shortest_taken, length);
    if (!taken.contains(i)) longest_left = std::max(longest_left, length);
  }
  EXPECT_GE(shortest_taken, longest_left);

  few.max_lines = 0;
  EXPECT_TRUE(scene.look(few, scene.T_cw, 5.0).visible.empty());
}

TEST(LineTracker, LeavesOutWhatShowsTooShort) {
  const Scene scene;
  LineTrackerOptions long_ones = options();
  long_ones.min_length = 60.0;
  const LineSights sights = scene.look(long_ones, scene.T_cw, 5.0);
  const std::set<int> taken(sights.visible.begin(), sights.visible.end());
  for (int i = 0; i < static_cast<int>(scene.local->lines.size()); ++i) {
    const double length = scene.length(scene.local->lines[static_cast<std::size_t>(i)]);
    EXPECT_EQ(taken.contains(i), length >= 60.0) << length << " pixels";
  }
  EXPECT_TRUE(!taken.empty() && taken.size() < scene.local->lines.size()) << "both kinds should be there";
}

TEST(LineTracker, LinesBehindTheCameraOrOutsideTheImageAreNotVisible) {
  const Scene scene;
  EXPECT_TRUE(scene.look(options(), camera_at({0.0, 0.0, 0.0}, std::numbers::pi), 5.0).visible.empty());
  EXPECT_TRUE(scene.look(options(), camera_at({0.0, 0.0, 5.0}), 5.0).visible.empty());

  // Turned to the right by half the angle of view: the left half of the lines leaves the image.
  const SE3 turned = camera_at({0.0, 0.0, 0.0}, 0.5);
  const LineSights sights = scene.look(options(), turned, 5.0);
  const std::set<int> taken(sights.visible.begin(), sights.visible.end());
  int inside = 0, outside = 0;
  for (int i = 0; i < static_cast<int>(scene.local->lines.size()); ++i) {
    const LocalLine& line = scene.local->lines[static_cast<std::size_t>(i)];
    const double a = scene.project(line.start, turned).x(), b = scene.project(line.end, turned).x();
    if (std::max(a, b) < 0.0) {
      EXPECT_FALSE(taken.contains(i));
      ++outside;
    } else if (std::min(a, b) > 0.0) {
      EXPECT_TRUE(taken.contains(i));
      ++inside;
    }
  }
  EXPECT_TRUE(inside > 10 && outside > 10);
}

TEST(LineTracker, HandsTheLinesFoundToThePoseOptimiser) {
  const Scene scene;
  const LineTracker tracker(kTestCamera, options());
  const LineSights sights = tracker.look(scene.grey, scene.T_cw, *scene.local, 5.0);
  const std::vector<LineMatch> matches = tracker.matches(sights, *scene.local);
  ASSERT_EQ(matches.size(), sights.found.size());
  ASSERT_FALSE(matches.empty());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const LineSight& sight = sights.found[i];
    EXPECT_EQ(matches[i].line_w.moment, scene.local->lines[static_cast<std::size_t>(sight.line)].line.moment);
    EXPECT_EQ(matches[i].start, sight.at.start);
    EXPECT_EQ(matches[i].end, sight.at.end);
    EXPECT_EQ(matches[i].sigma2, sight.at.sigma2);
    EXPECT_EQ(matches[i].weight, 1.0);
  }
}

TEST(LineTracker, MeasuresTheDepthOfWhatItFinds) {
  Camera bent = kTestCamera;
  bent.k1 = -0.15;
  for (const Camera& camera : {kTestCamera, bent}) {
    const Scene scene(camera);
    LineTrackerOptions with_sigma = options();
    with_sigma.depth_sigma = 0.02;
    const LineTracker tracker(camera, with_sigma, kTestNoise);
    LineSights sights = tracker.look(scene.grey, scene.T_cw, *scene.local, 5.0);
    for (const LineMatch& m : tracker.matches(sights, *scene.local)) EXPECT_EQ(m.inverse_start, 0.0);

    tracker.measure_depth(scene.world.depth(scene.T_cw), sights);
    std::size_t known = 0;
    const std::vector<LineMatch> matches = tracker.matches(sights, *scene.local);
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const LineMatch& m = matches[i];
      if (m.inverse_start <= 0.0) continue;
      ++known;
      // Next to a corner, pixels of the other edge are up to 8 pixels off along this one.
      const Line3 line_c = scene.T_cw * m.line_w;
      EXPECT_NEAR(m.inverse_start, inverse_depth_at(camera, line_c, m.start), 0.008) << "line " << i;
      EXPECT_NEAR(m.inverse_end, inverse_depth_at(camera, line_c, m.end), 0.008) << "line " << i;
      EXPECT_DOUBLE_EQ(m.sigma_start, std::hypot(0.02, std::sqrt(sights.found[i].depth.covariance(0, 0))));
      EXPECT_DOUBLE_EQ(m.sigma_end, std::hypot(0.02, std::sqrt(sights.found[i].depth.covariance(1, 1))));
    }
    EXPECT_GT(known, 45U);

    tracker.measure_depth({}, sights);
    for (const LineMatch& m : tracker.matches(sights, *scene.local)) EXPECT_EQ(m.inverse_start, 0.0);
  }
}

TEST(LineTracker, WhatItFindsFixesThePose) {
  const Scene scene;
  const SE3 off =
      SE3::exp((Vector6d() << 0.004, -0.003, 0.005, 0.003, 0.003, -0.003).finished()) * scene.T_cw;
  const LineTracker tracker(kTestCamera, options());
  const LineSights sights = tracker.look(scene.grey, off, *scene.local, 8.0);
  const PoseEstimate estimate =
      PoseOptimizer(kTestCamera, kTestNoise, {}).optimize(off, {}, tracker.matches(sights, *scene.local));
  EXPECT_GT(estimate.line_inliers, 50);
  // A tenth of a pixel is half a millimetre at 2.5 m; some sixty lines in all directions average it out.
  EXPECT_LT(pose_difference(estimate.T_cw, scene.T_cw), 5e-4);
}

}  // namespace
}  // namespace ipl_slam
