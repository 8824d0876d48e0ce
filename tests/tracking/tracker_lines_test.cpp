// The tracker with lines beside points, or without any.

#include <map>

#include <gtest/gtest.h>

#include "support/line_world.hpp"
#include "support/world_map.hpp"
#include "tracking/tracker.hpp"

namespace ipl_slam {
namespace {

using namespace test;

const ViewOptions kNoisy{.pixel_noise = 0.5, .inverse_depth_noise = 0.01, .flipped_bits = 20};

// Small steps: up to 2.5 pixels a frame, of which a tracker without a velocity yet has to find the first.
SE3 on_short_path(std::size_t index) {
  const double t = static_cast<double>(index);
  return camera_at({0.004 * t, -0.002 * t, 0.003 * t}, 0.003 * t, 0.002 * t);
}

TrackerOptions line_options() {
  TrackerOptions options;
  options.line_support = 3.0;
  options.min_inliers = 30;
  return options;
}

// A tracker in a world of rectangles without a single keypoint; the map was started with frame 0 of the path.
struct StartedOnLines {
  explicit StartedOnLines(const TrackerOptions& options = line_options())
      : tracker(kTestCamera, kTestPyramid, kTestNoise, options) {
    const LineView first = world.look(on_short_path(0), 0);
    TrackedFrame tracked = tracker.track(first.frame, nullptr);
    map.add(first);
    local = map.snapshot();
    tracked.state = TrackingState::kTracking;
    tracked.reference = KeyframeId{0};
    tracker.start(tracked);
  }
  TrackedFrame track_at(const SE3& T_cw, std::size_t index) {
    return tracker.track(SyntheticWorld::make_frame({}, index), local, world.image(T_cw));
  }
  TrackedFrame track(std::size_t index) { return track_at(on_short_path(index), index); }
  TrackedFrame track_without_image(std::size_t index) {
    return tracker.track(SyntheticWorld::make_frame({}, index), local);
  }

  LineWorld world;
  LineWorldMap map{world};
  Tracker tracker;
  std::shared_ptr<const LocalMap> local;
};

// Lines are found to about a tenth of a pixel, half a millimetre at 2.5 m; tens of them in all directions
// leave less than that.
constexpr double kSettledOnLines = 1e-3;

TEST(TrackerLines, CarryACameraThatSeesNoPoint) {
  StartedOnLines s;
  for (std::size_t i = 1; i <= 20; ++i) {
    const TrackedFrame tracked = s.track(i);
    ASSERT_EQ(tracked.state, TrackingState::kTracking) << "frame " << i;
    EXPECT_LT(pose_difference(tracked.T_cw, on_short_path(i)), kSettledOnLines) << "frame " << i;
    EXPECT_EQ(tracked.inliers, 0);
    EXPECT_GT(tracked.lines.size(), 30U);
    EXPECT_EQ(tracked.reference, KeyframeId{0});
    EXPECT_LT(pose_difference(tracked.T_c_reference, tracked.T_cw * on_short_path(0).inverse()), 1e-9);
  }
}

TEST(TrackerLines, LieWhereTheyShow) {
  StartedOnLines s;
  const TrackedFrame tracked = s.track(1);
  ASSERT_FALSE(tracked.lines.empty());
  for (const SeenLine& seen : tracked.lines) {
    const Line& line = s.map.map.lines()[seen.line];
    const auto truth = project_line(kTestCamera, on_short_path(1) * line.line);
    EXPECT_LT(std::abs(signed_distance(*truth, seen.start)), 0.3);
    EXPECT_LT(std::abs(signed_distance(*truth, seen.end)), 0.3);
  }
}

TEST(TrackerLines, WithoutAnImageACameraThatSeesNoPointIsLost) {
  StartedOnLines s;
  (void)s.track(1);
  const TrackedFrame tracked = s.track_without_image(2);
  EXPECT_EQ(tracked.state, TrackingState::kLost);
  EXPECT_TRUE(tracked.lines.empty());
  EXPECT_LT(pose_difference(tracked.T_cw, on_short_path(1)), kSettledOnLines) << "the last pose known";
}

TEST(TrackerLines, InTheDarkItIsLostToo) {
  StartedOnLines s;
  (void)s.track(1);
  const cv::Mat dark(480, 640, CV_8UC1, cv::Scalar(0));
  EXPECT_EQ(s.tracker.track(SyntheticWorld::make_frame({}, 2), s.local, dark).state, TrackingState::kLost);
}

TEST(TrackerLines, TooFewAreNoPose) {
  TrackerOptions options = line_options();
  options.lines.max_lines = 5;  // worth 15 points
  StartedOnLines s(options);
  EXPECT_EQ(s.track(1).state, TrackingState::kLost);
}

// A picture of straight edges and the local map that fits it, seen from the origin.
class Edges {
 public:
  explicit Edges(const LocalMap& started) : map(std::make_shared<LocalMap>(started)) {
    map->lines.clear();
    for (LocalKeyframe& keyframe : map->keyframes) keyframe.lines.clear();
  }
  /// A bright bar at depth z; the bright side is on the right of each of its edges.
  void add_bar(const cv::Rect& bar, double z) {
    image(bar).setTo(140);
    const double left = bar.x - 0.5, right = left + bar.width, top = bar.y - 0.5, bottom = top + bar.height;
    if (bar.width > bar.height) {
      add_edge({left, top}, {right, top}, z);
      add_edge({right, bottom}, {left, bottom}, z);
    } else {
      add_edge({left, bottom}, {left, top}, z);
      add_edge({right, top}, {right, bottom}, z);
    }
  }

  std::shared_ptr<LocalMap> map;
  cv::Mat image{kTestCamera.height, kTestCamera.width, CV_8UC1, cv::Scalar(60)};

 private:
  void add_edge(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double z) {
    const Eigen::Vector3d start = kTestCamera.unproject(from, z), end = kTestCamera.unproject(to, z);
    const LineId id{static_cast<std::uint32_t>(map->lines.size())};
    map->lines.push_back({id, *Line3::through(start, end), start, end, 80.0F, 3});
  }
};

TEST(TrackerLines, ParallelOnesAreNoPoseHoweverMany) {
  const auto state = [](bool with_upright_ones) {
    StartedOnLines s;
    Edges edges(*s.local);
    for (int i = 0; i < 8; ++i) edges.add_bar({70, 20 + 56 * i, 480, 28}, 2.0 + 0.3 * i);
    if (with_upright_ones) edges.add_bar({590, 40, 30, 400}, 3.0);
    return s.tracker.track(SyntheticWorld::make_frame({}, 1), edges.map, edges.image).state;
  };
  EXPECT_EQ(state(false), TrackingState::kLost) << "nothing says how far the camera went along them";
  EXPECT_EQ(state(true), TrackingState::kTracking);
}

TEST(TrackerLines, BringALostCameraBackThatHasNotGoneFar) {
  StartedOnLines s;
  (void)s.track(1);
  ASSERT_EQ(s.track_without_image(2).state, TrackingState::kLost);
  const TrackedFrame tracked = s.track(3);
  EXPECT_EQ(tracked.state, TrackingState::kTracking);
  EXPECT_LT(pose_difference(tracked.T_cw, on_short_path(3)), kSettledOnLines);
}

TEST(TrackerLines, HelpWherePointsAreFew) {
  // A dozen points are not enough by themselves, nor is the share of lines allowed here.
  const auto state = [](bool with_points, bool with_lines) {
    TrackerOptions options = line_options();
    options.lines.max_lines = 8;
    options.min_prediction_inliers = 8;
    const SyntheticWorld points(4, 25, {-0.8, -0.6, 2.0}, {0.8, 0.6, 3.0});
    const LineWorld lines;
    WorldMap map(points);
    Tracker tracker(kTestCamera, kTestPyramid, kTestNoise, options);
    const View first = points.look(SE3{}, 0);
    map.add(first);
    LineWorldMap line_map(lines);
    line_map.add(lines.look(SE3{}, 0));
    LocalMap local = *map.snapshot();
    local.lines = line_map.snapshot()->lines;
    for (std::uint32_t i = 0; i < local.lines.size(); ++i) local.keyframes[0].lines.push_back(i);
    TrackedFrame tracked = tracker.track(first.frame, nullptr);
    tracked.state = TrackingState::kTracking;
    tracked.reference = KeyframeId{0};
    tracker.start(tracked);
    const SE3 T_cw = camera_at({0.002, 0.0, 0.0});
    const auto frame = with_points ? points.look(T_cw, 1).frame : SyntheticWorld::make_frame({}, 1);
    const cv::Mat grey = with_lines ? lines.image(T_cw) : cv::Mat();
    return tracker.track(frame, std::make_shared<const LocalMap>(local), grey).state;
  };
  EXPECT_EQ(state(true, true), TrackingState::kTracking);
  EXPECT_EQ(state(true, false), TrackingState::kLost);
  EXPECT_EQ(state(false, true), TrackingState::kLost);
}

TEST(TrackerLines, TheirDepthCountsWherePointsAreRare) {
  StartedOnLines without, right, wrong;
  const SE3 T_cw = on_short_path(1);
  const auto track = [&](StartedOnLines& s, const cv::Mat& depth) {
    return s.tracker.track(SyntheticWorld::make_frame({}, 1), s.local, s.world.image(T_cw), depth).T_cw;
  };
  const cv::Mat depth = right.world.depth(T_cw);
  cv::Mat farther;
  depth.convertTo(farther, CV_16U, 1.02);  // by 0.008 1/m at 2.5 m
  EXPECT_LT(pose_difference(track(right, depth), T_cw), kSettledOnLines);
  const double pull = track(without, {}).translation().z() - track(wrong, farther).translation().z();
  EXPECT_LT(pull, -1e-4) << "the camera steps back, as far as the image lets it";
}

TEST(TrackerLines, TheirDepthIsNotLookedAtWherePointsAreEnough) {
  const auto place = [](int confident_inliers, bool with_depth) {
    TrackerOptions options = line_options();
    options.confident_inliers = confident_inliers;
    const SyntheticWorld points;
    const LineWorld lines;
    WorldMap map(points);
    LineWorldMap line_map(lines);
    Tracker tracker(kTestCamera, kTestPyramid, kTestNoise, options);
    const View first = points.look(SE3{}, 0, kNoisy);
    map.add(first);
    line_map.add(lines.look(SE3{}, 0));
    LocalMap local = *map.snapshot();
    local.lines = line_map.snapshot()->lines;
    for (std::uint32_t i = 0; i < local.lines.size(); ++i) local.keyframes[0].lines.push_back(i);
    TrackedFrame tracked = tracker.track(first.frame, nullptr);
    tracked.state = TrackingState::kTracking;
    tracked.reference = KeyframeId{0};
    tracker.start(tracked);
    const SE3 T_cw = camera_at({0.002, 0.0, 0.0});
    const cv::Mat depth = with_depth ? lines.depth(T_cw) : cv::Mat();
    tracked = tracker.track(points.look(T_cw, 1, kNoisy).frame, std::make_shared<const LocalMap>(local),
                            lines.image(T_cw), depth);
    EXPECT_GT(tracked.inliers, 50);
    EXPECT_GT(tracked.lines.size(), 30U);
    return tracked.T_cw.translation();
  };
  EXPECT_EQ(place(50, true), place(50, false));
  EXPECT_NE(place(10000, true), place(10000, false));
}

TEST(TrackerLines, TheReferenceIsTheKeyframeThatSharesMostLines) {
  TrackerOptions options = line_options();
  options.lines.max_lines = 1000;
  StartedOnLines s(options);
  const auto turning = [](std::size_t i) {
    return camera_at({0.0, 0.0, 0.0}, 0.014 * static_cast<double>(i));
  };
  s.map.add(s.world.look(turning(30), 1));
  s.local = s.map.snapshot();
  for (std::size_t i = 1; i <= 30; ++i) {
    const TrackedFrame tracked = s.track_at(turning(i), i);
    ASSERT_EQ(tracked.state, TrackingState::kTracking) << "frame " << i;
    if (i > 3 && i < 28) continue;  // where it changes is not the point
    EXPECT_EQ(tracked.reference, KeyframeId{i <= 3 ? 0U : 1U}) << "at frame " << i;
  }
}

TEST(TrackerLines, StartAMapWherePointsDoNot) {
  TrackerOptions options;
  options.line_support = 3.0;
  const LineWorld world;
  const LineView whole = world.look(SE3{}), flat = world.look(SE3{}, 0, {.depth_share = 0.0});
  options.min_initial_depths = static_cast<int>(3 * whole.lines->size());
  EXPECT_TRUE(
      Tracker(kTestCamera, kTestPyramid, kTestNoise, options).can_start_map(*whole.frame, whole.lines.get()));
  EXPECT_FALSE(
      Tracker(kTestCamera, kTestPyramid, kTestNoise, options).can_start_map(*flat.frame, flat.lines.get()))
      << "without depth they are no landmarks";
  EXPECT_FALSE(Tracker(kTestCamera, kTestPyramid, kTestNoise, options).can_start_map(*whole.frame));
  ++options.min_initial_depths;
  EXPECT_FALSE(
      Tracker(kTestCamera, kTestPyramid, kTestNoise, options).can_start_map(*whole.frame, whole.lines.get()));
}

TEST(TrackerLines, FollowAMapThatMoves) {
  StartedOnLines s;
  for (std::size_t i = 1; i <= 3; ++i) (void)s.track(i);
  const SE3 T_wn = SE3::exp((Vector6d() << 0.8, -0.4, 0.9, 0.1, 0.5, -0.2).finished()), T_nw = T_wn.inverse();
  s.map.map.set_pose(KeyframeId{0}, on_short_path(0) * T_wn);
  std::vector<LineId> lines;
  s.map.map.lines().for_each([&](LineId id, const Line&) { lines.push_back(id); });
  for (const LineId id : lines) {
    const Line line = s.map.map.lines()[id];
    s.map.map.set_line(id, T_nw * line.line, T_nw * line.start, T_nw * line.end);
  }
  s.local = s.map.snapshot();
  for (std::size_t i = 4; i <= 6; ++i) {
    const TrackedFrame tracked = s.track(i);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_short_path(i) * T_wn), kSettledOnLines);
  }
}

std::map<LineId, std::pair<int, int>> sum_of(const std::vector<Sighting<LineId>>& sightings) {
  std::map<LineId, std::pair<int, int>> counts;
  for (const Sighting<LineId>& sighting : sightings) {
    counts[sighting.landmark].first += sighting.visible;
    counts[sighting.landmark].second += sighting.found;
  }
  return counts;
}

TEST(TrackerSightings, CountEveryLineOncePerFrame) {
  StartedOnLines s;
  std::map<LineId, int> expected;
  for (std::size_t i = 1; i <= 3; ++i) {
    for (const SeenLine& seen : s.track(i).lines) ++expected[seen.line];
    if (i == 2) s.local = s.map.snapshot();  // what was counted survives a new local map
  }
  const auto counts = sum_of(s.tracker.take_line_sightings());
  EXPECT_GT(counts.size(), 30U);
  EXPECT_TRUE(s.tracker.take_sightings().empty()) << "there is no point";
  for (const auto& [id, count] : counts) {
    EXPECT_LE(count.second, count.first) << "found without being visible";
    EXPECT_LE(count.first, 3);
    EXPECT_EQ(count.second, expected[id]);
  }
  EXPECT_TRUE(s.tracker.take_line_sightings().empty()) << "they are handed over once";
}

TEST(TrackerSightings, ALineThatIsCoveredIsVisibleButNotFound) {
  StartedOnLines s;
  cv::Mat half = s.world.image(on_short_path(1));
  half.colRange(0, 320).setTo(90);
  const TrackedFrame tracked = s.tracker.track(SyntheticWorld::make_frame({}, 1), s.local, half);
  ASSERT_EQ(tracked.state, TrackingState::kTracking);
  std::size_t found = 0, hidden = 0;
  for (const auto& [id, count] : sum_of(s.tracker.take_line_sightings())) {
    const Line& line = s.map.map.lines()[id];
    const double a = kTestCamera.project(on_short_path(1) * line.start).x(),
                 b = kTestCamera.project(on_short_path(1) * line.end).x();
    found += static_cast<std::size_t>(count.second);
    if (std::max(a, b) > 310.0) continue;
    ++hidden;
    EXPECT_EQ(count.second, 0);
  }
  EXPECT_EQ(found, tracked.lines.size());
  EXPECT_GT(hidden, 10U);
}

TEST(TrackerSightings, AFrameThatIsLostSaysNothingAboutLines) {
  TrackerOptions options = line_options();
  options.min_inliers = 100000;
  StartedOnLines s(options);
  ASSERT_EQ(s.track(1).state, TrackingState::kLost);
  EXPECT_TRUE(s.tracker.take_line_sightings().empty());
}

}  // namespace
}  // namespace ipl_slam
