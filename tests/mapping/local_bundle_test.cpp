#include "mapping/local_bundle.hpp"

#include <functional>

#include <gtest/gtest.h>

#include "support/line_world.hpp"
#include "support/map_checks.hpp"
#include "support/world_map.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Of 2 to 3 cm and as many hundredths of a radian of disturbance: a third of a pixel is 2 mm at 3 m, and an
// error of position goes with one of rotation that hides it.
constexpr double kSettled = 0.004;

// Six keyframes side by side that see much of the same, with poses and points that are centimetres off.
struct Window {
  explicit Window(const ViewOptions& options = {.pixel_noise = 0.3, .inverse_depth_noise = 0.003}) {
    for (std::size_t i = 0; i < 6; ++i) {
      truth.push_back(camera_at({0.15 * static_cast<double>(i), 0.0, 0.0}, 0.02 * static_cast<double>(i)));
      views.push_back(world.look(truth.back(), i, options));
      keyframes.push_back(map.add(views.back()));
    }
  }
  // Keyframe 0 stays true, so that there is a world to return to.
  void disturb() {
    Random random(8);
    for (std::size_t i = 1; i < keyframes.size(); ++i) {
      Vector6d twist;
      for (int k = 0; k < 6; ++k) twist[k] = 0.01 * random.normal();
      map.map.set_pose(keyframes[i], SE3::exp(twist) * truth[i]);
    }
    for (std::uint32_t i = 0; i < world.size(); ++i) {
      if (!map.point_of(i).valid()) continue;
      const Eigen::Vector3d error(random.normal(), random.normal(), random.normal());
      map.map.set_position(map.point_of(i), world.position(i) + 0.02 * error);
    }
  }
  void adjust(std::size_t centre = 5, const std::atomic<bool>* abort = nullptr) {
    adjust_local_bundle(map.map, keyframes[centre], kTestCamera, kTestNoise, options, abort);
  }
  [[nodiscard]] double pose_error(std::size_t i) const {
    return pose_difference(map.map.keyframes()[keyframes[i]].T_cw, truth[i]);
  }
  [[nodiscard]] double mean_point_error() const {
    double sum = 0.0;
    int count = 0;
    for (std::uint32_t i = 0; i < world.size(); ++i) {
      if (!map.point_of(i).valid() || !map.map.points().contains(map.point_of(i))) continue;
      sum += (map.map.points()[map.point_of(i)].position - world.position(i)).norm();
      ++count;
    }
    return sum / count;
  }
  [[nodiscard]] std::size_t observations() const {
    std::size_t count = 0;
    map.map.points().for_each([&](PointId, const Point& point) { count += point.observations.size(); });
    return count;
  }

  SyntheticWorld world;
  WorldMap map{world};
  std::vector<SE3> truth;
  std::vector<View> views;
  std::vector<KeyframeId> keyframes;
  LocalBundleOptions options;
};

void expect_same_pose(const SE3& a, const SE3& b) {
  EXPECT_EQ(a.translation(), b.translation());
  EXPECT_EQ(a.rotation().coeffs(), b.rotation().coeffs());
}

TEST(LocalBundle, BringsPosesAndPointsBack) {
  Window w;
  w.disturb();
  const double points_before = w.mean_point_error();
  w.adjust();
  for (std::size_t i = 1; i < 6; ++i) EXPECT_LT(w.pose_error(i), kSettled) << "keyframe " << i;
  EXPECT_LT(w.mean_point_error(), 0.5 * points_before);
  expect_consistent(w.map.map);
}

TEST(LocalBundle, TheFirstKeyframeHoldsTheWorld) {
  Window w;
  w.disturb();
  const SE3 before = w.map.map.keyframes()[w.keyframes[0]].T_cw;
  w.adjust();
  expect_same_pose(w.map.map.keyframes()[w.keyframes[0]].T_cw, before);
}

TEST(LocalBundle, KeyframesOutsideTheWindowHoldIt) {
  Window w;
  w.options.max_keyframes = 2;
  w.disturb();
  for (std::size_t i = 0; i < 4; ++i) w.map.map.set_pose(w.keyframes[i], w.truth[i]);
  w.adjust();
  for (std::size_t i = 0; i < 4; ++i) {
    expect_same_pose(w.map.map.keyframes()[w.keyframes[i]].T_cw, w.truth[i]);
  }
  EXPECT_LT(w.pose_error(4), kSettled);
  EXPECT_LT(w.pose_error(5), kSettled);
}

TEST(LocalBundle, WithoutFixedNeighboursTheOldestOfTheWindowStays) {
  Window w;
  w.options.max_keyframes = 2;
  w.options.max_fixed_keyframes = 0;
  w.disturb();
  const SE3 oldest = w.map.map.keyframes()[w.keyframes[4]].T_cw;
  const SE3 newest = w.map.map.keyframes()[w.keyframes[5]].T_cw;
  w.adjust();
  expect_same_pose(w.map.map.keyframes()[w.keyframes[4]].T_cw, oldest);
  EXPECT_GT(pose_difference(w.map.map.keyframes()[w.keyframes[5]].T_cw, newest), 0.0);
}

TEST(LocalBundle, AKeyframeThatSharesTooLittleIsNotOptimisedAlong) {
  Window w;
  w.options.min_shared = 100000;
  w.disturb();
  std::vector<SE3> before;
  for (const KeyframeId id : w.keyframes) before.push_back(w.map.map.keyframes()[id].T_cw);
  w.adjust();
  for (std::size_t i = 0; i < 5; ++i) {
    expect_same_pose(w.map.map.keyframes()[w.keyframes[i]].T_cw, before[i]);
  }
  EXPECT_GT(pose_difference(w.map.map.keyframes()[w.keyframes[5]].T_cw, before[5]), 0.0);
}

TEST(LocalBundle, OutliersLeaveTheMap) {
  Window w;
  // Wrong matches: the keypoints of two things far apart are swapped in one keyframe.
  const View& view = w.views[3];
  std::vector<std::pair<std::uint32_t, PointId>> wrong;
  const auto& points = w.map.map.keyframes()[w.keyframes[3]].points;
  const auto half = static_cast<std::uint32_t>(view.sources.size() / 2);
  for (std::uint32_t k = 0; k + half < view.sources.size() && wrong.size() < 40; k += 5) {
    const PointId a = points[k], b = points[k + half];
    const auto& keypoints = view.frame->features.keypoints;
    if ((keypoints[k].undistorted - keypoints[k + half].undistorted).norm() < 50.0F) continue;
    if (w.map.map.points()[a].observations.size() < 4 || w.map.map.points()[b].observations.size() < 4)
      continue;
    w.map.map.remove_observation(a, w.keyframes[3]);
    w.map.map.remove_observation(b, w.keyframes[3]);
    w.map.map.add_observation(a, w.keyframes[3], k + half);
    w.map.map.add_observation(b, w.keyframes[3], k);
    wrong.insert(wrong.end(), {{k + half, a}, {k, b}});
  }
  ASSERT_GE(wrong.size(), 20U);
  const std::size_t before = w.observations();
  w.disturb();
  w.adjust();
  for (const auto& [keypoint, point] : wrong) {
    EXPECT_FALSE(w.map.map.keyframes()[w.keyframes[3]].points[keypoint].valid());
    EXPECT_TRUE(w.map.map.points().contains(point)) << "its other observations are right";
  }
  EXPECT_LT(w.pose_error(3), kSettled) << "they did not pull the keyframe away";
  // The noise is a third of what the test expects: hardly a right one goes.
  EXPECT_LT(before - wrong.size() - w.observations(), before / 100);
  expect_consistent(w.map.map);
}

TEST(LocalBundle, APointThatLiesBehindItsOnlyCameraDies) {
  Window w;
  const auto point = w.map.map.keyframes()[w.keyframes[5]].points[7];
  while (w.map.map.points()[point].observations.size() > 1) {
    w.map.map.remove_observation(point, w.map.map.points()[point].observations.front().keyframe);
  }
  w.map.map.set_position(point, w.map.map.points()[point].position + Eigen::Vector3d(0.0, 0.0, -20.0));
  w.adjust();
  EXPECT_FALSE(w.map.map.points().contains(point));
  expect_consistent(w.map.map);
}

TEST(LocalBundle, RefreshesThePointsItMoved) {
  Window w;
  w.disturb();
  w.adjust();
  w.map.map.points().for_each([&](PointId id, const Point& point) {
    Map copy = w.map.map;
    copy.refresh(id);
    EXPECT_EQ(copy.points()[id].normal, point.normal);
    EXPECT_EQ(copy.points()[id].max_distance, point.max_distance);
  });
}

TEST(LocalBundle, ChangesNothingWhereItIsStoppedBeforeItStarts) {
  Window w;
  w.disturb();
  const Map before = w.map.map;
  const std::atomic<bool> abort = true;
  w.adjust(5, &abort);
  before.points().for_each([&](PointId id, const Point& point) {
    ASSERT_TRUE(w.map.map.points().contains(id));
    EXPECT_EQ(w.map.map.points()[id].position, point.position);
    EXPECT_EQ(w.map.map.points()[id].observations.size(), point.observations.size());
  });
  before.keyframes().for_each(
      [&](KeyframeId id, const Keyframe& k) { expect_same_pose(w.map.map.keyframes()[id].T_cw, k.T_cw); });
}

TEST(LocalBundle, AKeyframeWithoutPointsStaysWhereItIs) {
  Window w;
  const SE3 T_cw = camera_at({3.0, 0.0, 0.0});
  const KeyframeId empty = w.map.map.add_keyframe(SyntheticWorld::make_frame({}), T_cw);
  adjust_local_bundle(w.map.map, empty, kTestCamera, kTestNoise, {}, nullptr);
  expect_same_pose(w.map.map.keyframes()[empty].T_cw, T_cw);
}

// As kSettled, but from some eighty lines instead of hundreds of points.
constexpr double kLinesSettled = 0.008;

// Six keyframes side by side that see the same rectangles and no points.
struct LineWindow {
  using Spoil = std::function<void(std::size_t keyframe, LineFeatures& lines)>;

  explicit LineWindow(
      const LineViewOptions& options = {.pixel_noise = 0.3, .inverse_depth_noise = 0.003},
      const Spoil& spoil = [](std::size_t, LineFeatures&) {}) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double t = static_cast<double>(i);
      truth.push_back(camera_at({0.05 * t, 0.02 * t, 0.0}, 0.02 * t));
      views.push_back(world.look(truth.back(), i, options));
      LineFeatures lines = *views.back().lines;
      spoil(i, lines);
      views.back().lines = std::make_shared<const LineFeatures>(std::move(lines));
      keyframes.push_back(map.add(views.back()));
    }
  }
  // Keyframe 0 stays true, so that there is a world to return to.
  void disturb() {
    Random random(8);
    for (std::size_t i = 1; i < keyframes.size(); ++i) {
      Vector6d twist;
      for (int k = 0; k < 6; ++k) twist[k] = 0.01 * random.normal();
      map.map.set_pose(keyframes[i], SE3::exp(twist) * truth[i]);
    }
  }
  void disturb_lines() {
    Random random(9);
    for (std::uint32_t i = 0; i < world.size(); ++i) {
      if (!map.line_of(i).valid()) continue;
      const auto error = [&]() -> Eigen::Vector3d {
        return 0.01 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      };
      const Eigen::Vector3d start = world.edge(i).start + error(), end = world.edge(i).end + error();
      map.map.set_line(map.line_of(i), *Line3::through(start, end), start, end);
    }
  }
  void adjust(const std::atomic<bool>* abort = nullptr) {
    adjust_local_bundle(map.map, keyframes.back(), kTestCamera, kTestNoise, options, abort);
  }
  [[nodiscard]] double pose_error(std::size_t i) const {
    return pose_difference(map.map.keyframes()[keyframes[i]].T_cw, truth[i]);
  }
  // Mean distance of the true ends from the lines of the map, m.
  [[nodiscard]] double mean_line_error() const {
    double sum = 0.0;
    int count = 0;
    for (std::uint32_t i = 0; i < world.size(); ++i) {
      if (!map.line_of(i).valid() || !map.map.lines().contains(map.line_of(i))) continue;
      const Line3& line = map.map.lines()[map.line_of(i)].line;
      sum += line.distance(world.edge(i).start) + line.distance(world.edge(i).end);
      count += 2;
    }
    return sum / count;
  }
  [[nodiscard]] std::size_t observations() const {
    std::size_t count = 0;
    map.map.lines().for_each([&](LineId, const Line& line) { count += line.observations.size(); });
    return count;
  }

  LineWorld world;
  LineWorldMap map{world};
  std::vector<SE3> truth;
  std::vector<LineView> views;
  std::vector<KeyframeId> keyframes;
  LocalBundleOptions options;
};

TEST(LocalBundleLines, BringPosesBack) {
  LineWindow w;
  w.disturb();
  w.adjust();
  for (std::size_t i = 1; i < 6; ++i) EXPECT_LT(w.pose_error(i), kLinesSettled) << "keyframe " << i;
  expect_consistent(w.map.map);
}

TEST(LocalBundleLines, ComeBackThemselves) {
  LineWindow w(LineViewOptions{});
  w.disturb();
  w.disturb_lines();
  ASSERT_GT(w.mean_line_error(), 0.005);
  w.adjust();
  // What the steps allowed leave of a centimetre where nothing is noisy.
  EXPECT_LT(w.mean_line_error(), 5e-4);
  for (std::size_t i = 1; i < 6; ++i) EXPECT_LT(w.pose_error(i), 5e-4) << "keyframe " << i;
  expect_consistent(w.map.map);
}

TEST(LocalBundleLines, AnOutlierLeavesTheMap) {
  // Wrong matches, as lines that run side by side invite them: every seventh segment of keyframe 3 lies 15
  // pixels beside its line.
  constexpr std::uint32_t kEvery = 7;
  LineWindow w({.pixel_noise = 0.3, .inverse_depth_noise = 0.003},
               [](std::size_t keyframe, LineFeatures& lines) {
                 for (std::uint32_t s = 0; keyframe == 3 && s < lines.size(); s += kEvery) {
                   LineSegment& segment = lines.segments[s];
                   const Eigen::Vector2f along = (segment.end - segment.start).normalized();
                   const Eigen::Vector2f across = 15.0F * Eigen::Vector2f(-along.y(), along.x());
                   segment.start += across;
                   segment.end += across;
                 }
               });
  std::vector<std::pair<std::uint32_t, LineId>> wrong;
  const std::vector<LineId> lines = w.map.map.keyframes()[w.keyframes[3]].lines;
  for (std::uint32_t s = 0; s < lines.size(); s += kEvery) {
    if (w.map.map.lines()[lines[s]].observations.size() >= 4) wrong.emplace_back(s, lines[s]);
  }
  ASSERT_GE(wrong.size(), 6U);
  const std::size_t before = w.observations();
  w.disturb();
  w.adjust();
  for (const auto& [segment, line] : wrong) {
    EXPECT_FALSE(w.map.map.keyframes()[w.keyframes[3]].lines[segment].valid());
    EXPECT_TRUE(w.map.map.lines().contains(line)) << "its other observations are right";
  }
  EXPECT_LT(w.pose_error(3), kLinesSettled) << "they did not pull the keyframe away";
  // The noise is a third of what the test expects: hardly a right one goes.
  EXPECT_LE(before - wrong.size() - w.observations(), before / 50);
  expect_consistent(w.map.map);
}

TEST(LocalBundleLines, ALineThatNoKeyframeShowsDies) {
  LineWindow w(LineViewOptions{});
  const LineId id = w.map.map.keyframes()[w.keyframes[5]].lines[7];
  while (w.map.map.lines()[id].observations.size() > 1) {
    w.map.map.remove_observation(id, w.map.map.lines()[id].observations.front().keyframe);
  }
  const Line line = w.map.map.lines()[id];
  const Eigen::Vector3d back(0.0, 0.0, -20.0);  // behind the cameras
  w.map.map.set_line(id, *Line3::through(line.start + back, line.end + back), line.start + back,
                     line.end + back);
  w.adjust();
  EXPECT_FALSE(w.map.map.lines().contains(id));
  expect_consistent(w.map.map);
}

TEST(LocalBundleLines, ReachAsFarAsTheirObservationsShow) {
  LineWindow w(LineViewOptions{});
  // Ends that nobody has seen there; the line itself is right.
  std::vector<LineId> ids;
  w.map.map.lines().for_each([&](LineId id, const Line&) { ids.push_back(id); });
  for (const LineId id : ids) {
    const Line line = w.map.map.lines()[id];
    w.map.map.set_line(id, line.line, line.start - 0.5 * line.line.direction, line.end + line.line.direction);
  }
  w.adjust();
  for (std::uint32_t i = 0; i < w.world.size(); ++i) {
    if (!w.map.line_of(i).valid()) continue;
    const Line& line = w.map.map.lines()[w.map.line_of(i)];
    // Float pixels and inverse depths at 3 m, and a line that runs slightly into the image.
    EXPECT_LT((line.start - w.world.edge(i).start).norm(), 1e-4);
    EXPECT_LT((line.end - w.world.edge(i).end).norm(), 1e-4);
  }
}

TEST(LocalBundleLines, ChangeNothingWhereItIsStoppedBeforeItStarts) {
  LineWindow w;
  w.disturb();
  const Map before = w.map.map;
  const std::atomic<bool> abort = true;
  w.adjust(&abort);
  before.lines().for_each([&](LineId id, const Line& line) {
    ASSERT_TRUE(w.map.map.lines().contains(id));
    EXPECT_EQ(w.map.map.lines()[id].line.moment, line.line.moment);
    EXPECT_EQ(w.map.map.lines()[id].observations.size(), line.observations.size());
  });
  before.keyframes().for_each(
      [&](KeyframeId id, const Keyframe& k) { expect_same_pose(w.map.map.keyframes()[id].T_cw, k.T_cw); });
}

TEST(LocalBundleLines, SegmentsThatAreNoLandmarkDoNotMatter) {
  const auto adjusted = [](bool with_segments) {
    const SyntheticWorld world;
    const LineWorld lines;
    WorldMap map(world);
    for (std::size_t i = 0; i < 4; ++i) {
      const View view =
          world.look(camera_at({0.15 * static_cast<double>(i), 0.0, 0.0}), i, {.pixel_noise = 0.3});
      map.add(view);
    }
    const SE3 T_cw = camera_at({0.6, 0.0, 0.0});
    const View last = world.look(T_cw, 4, {.pixel_noise = 0.3});
    const KeyframeId id =
        map.map.add_keyframe(last.frame, T_cw, with_segments ? lines.look(T_cw).lines : nullptr);
    for (std::uint32_t k = 0; k < last.sources.size(); ++k) {
      if (map.point_of(last.sources[k]).valid())
        map.map.add_observation(map.point_of(last.sources[k]), id, k);
    }
    adjust_local_bundle(map.map, id, kTestCamera, kTestNoise, {}, nullptr);
    EXPECT_EQ(map.map.lines().size(), 0U);
    expect_consistent(map.map);
    std::vector<double> numbers;
    map.map.keyframes().for_each([&](KeyframeId, const Keyframe& k) {
      for (int i = 0; i < 3; ++i) numbers.push_back(k.T_cw.translation()[i]);
      for (int i = 0; i < 4; ++i) numbers.push_back(k.T_cw.rotation().coeffs()[i]);
    });
    map.map.points().for_each([&](PointId, const Point& p) {
      for (int i = 0; i < 3; ++i) numbers.push_back(p.position[i]);
    });
    return numbers;
  };
  EXPECT_EQ(adjusted(true), adjusted(false));
}

}  // namespace
}  // namespace ipl_slam
