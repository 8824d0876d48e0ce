#include "mapping/line_mapping.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/line_world.hpp"
#include "support/map_checks.hpp"

namespace ipl_slam {
namespace {

using namespace test;

const SE3 kLeft = camera_at({-0.1, 0.0, 0.0});
const SE3 kRight = camera_at({0.1, 0.0, 0.0}, 0.05);

LineMappingOptions options() {
  LineMappingOptions result;
  result.radius = 5.0;
  result.inverse_depth_gate = 0.1;
  result.fusion_radius = 2.0;
  result.match.max_distance = 80;
  return result;
}

LineMapping mapping(const LineMappingOptions& mapping_options = options()) {
  return {kTestCamera, kTestNoise, mapping_options};
}

// Two keyframes of the same rectangles. The first one's lines are those of the map; the second knows nothing
// of them.
struct Pair {
  explicit Pair(const LineViewOptions& view_options = {}, const SE3& seen_from = kRight)
      : view(world.look(seen_from, 1, view_options)) {
    left = map.add(world.look(kLeft, 0));
    right = map.map.add_keyframe(view.frame, kRight, view.lines);
    for (const std::uint32_t i : view.sources) {
      if (map.line_of(i).valid()) shown_twice.push_back(i);
    }
  }
  // What the tracker says it saw: all lines of the map.
  [[nodiscard]] std::vector<SeenLine> tracked() const {
    std::vector<SeenLine> seen;
    map.map.lines().for_each([&](LineId id, const Line&) {
      seen.push_back({id, Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
    });
    return seen;
  }
  [[nodiscard]] LineId seen_right(std::uint32_t source) const {
    return map.map.keyframes()[right].lines[static_cast<std::size_t>(view.segment_of(source))];
  }
  // How many edges shown twice are a line that both keyframes see.
  [[nodiscard]] std::size_t united() const {
    return static_cast<std::size_t>(
        std::count_if(shown_twice.begin(), shown_twice.end(), [&](std::uint32_t i) {
          return seen_right(i).valid() && seen_right(i) == map.map.resolve(map.line_of(i));
        }));
  }
  // How many segments of the second keyframe have a line.
  [[nodiscard]] std::size_t associated() const {
    const auto& lines = map.map.keyframes()[right].lines;
    return static_cast<std::size_t>(
        std::count_if(lines.begin(), lines.end(), [](LineId id) { return id.valid(); }));
  }

  LineWorld world;
  LineWorldMap map{world};
  LineView view;
  KeyframeId left, right;
  std::vector<std::uint32_t> shown_twice;
};

TEST(LineAssociation, FindsTheLinesThatWereTrackedAmongTheSegments) {
  Pair p;
  ASSERT_GT(p.shown_twice.size(), 40U);
  mapping().associate(p.map.map, p.right, p.tracked());
  EXPECT_EQ(p.united(), p.shown_twice.size());
  EXPECT_EQ(p.associated(), p.shown_twice.size()) << "and nothing else";
  expect_consistent(p.map.map);
}

TEST(LineAssociation, FindsTheLinesOfNeighboursThatWereNotTracked) {
  Pair p;
  const std::uint32_t known = p.shown_twice[5];
  p.map.map.add_observation(p.map.line_of(known), p.right,
                            static_cast<std::uint32_t>(p.view.segment_of(known)));
  mapping().associate(p.map.map, p.right, {});
  EXPECT_EQ(p.united(), p.shown_twice.size());
  expect_consistent(p.map.map);
}

TEST(LineAssociation, KnowsNothingWithoutNeighboursAndTracking) {
  Pair p;
  mapping().associate(p.map.map, p.right, {});
  EXPECT_EQ(p.associated(), 0U);
}

TEST(LineAssociation, FollowsLinesThatWereFusedAndForgetsThoseThatAreGone) {
  Pair p;
  std::vector<SeenLine> tracked = p.tracked();
  const std::uint32_t gone = p.shown_twice[0], fused = p.shown_twice[1];
  const LineId old = p.map.line_of(fused);
  const KeyframeId third =
      p.map.map.add_keyframe(p.world.look(kLeft, 2).frame, kLeft, p.world.look(kLeft, 2).lines);
  const Edge& edge = p.world.edge(fused);
  const LineId kept =
      p.map.map.add_line(*Line3::through(edge.start, edge.end), edge.start, edge.end, third,
                         static_cast<std::uint32_t>(p.world.look(kLeft, 2).segment_of(fused)));
  p.map.map.fuse(kept, old);
  p.map.map.remove(p.map.line_of(gone));
  mapping().associate(p.map.map, p.right, tracked);
  EXPECT_EQ(p.seen_right(fused), kept);
  EXPECT_FALSE(p.seen_right(gone).valid());
  EXPECT_EQ(p.associated(), p.shown_twice.size() - 1);
  expect_consistent(p.map.map);
}

TEST(LineAssociation, RefusesWhatLooksDifferent) {
  Pair p({.clutter_share = 1.0});
  mapping().associate(p.map.map, p.right, p.tracked());
  EXPECT_EQ(p.associated(), 0U);
}

TEST(LineAssociation, RefusesWhatLiesElsewhereInTheImage) {
  // Seen from where the camera turned on: 8 pixels beside where the lines project to.
  Pair p({}, camera_at({0.1, 0.0, 0.0}, 0.05 + 8.0 / 525.0));
  mapping().associate(p.map.map, p.right, p.tracked());
  for (const std::uint32_t i : p.shown_twice) {
    const LineSegment& segment = p.view.lines->segments[static_cast<std::size_t>(p.view.segment_of(i))];
    const Eigen::Vector2f along = (segment.end - segment.start).normalized();
    // Only along itself may a line move.
    if (std::abs(along.y()) > 0.8F) {
      EXPECT_FALSE(p.seen_right(i).valid());
    }
    EXPECT_TRUE(!p.seen_right(i).valid() || p.seen_right(i) == p.map.line_of(i));
  }
}

// All segments of the second keyframe measure this much more inverse depth than there is.
std::size_t associated_with_depth_error(float error, double gate) {
  Pair p;
  LineFeatures features = *p.view.lines;
  for (LineSegment& segment : features.segments) {
    segment.depth.inverse_start += error;
    segment.depth.inverse_end += error;
  }
  const KeyframeId id =
      p.map.map.add_keyframe(p.view.frame, kRight, std::make_shared<const LineFeatures>(std::move(features)));
  LineMappingOptions gated = options();
  gated.inverse_depth_gate = gate;
  mapping(gated).associate(p.map.map, id, p.tracked());
  const auto& lines = p.map.map.keyframes()[id].lines;
  return static_cast<std::size_t>(
      std::count_if(lines.begin(), lines.end(), [](LineId line) { return line.valid(); }));
}

TEST(LineAssociation, RefusesWhatLiesAtAnotherDepth) {
  EXPECT_EQ(associated_with_depth_error(0.15F, 0.1), 0U);
  EXPECT_GT(associated_with_depth_error(0.05F, 0.1), 40U) << "within the gate";
  EXPECT_GT(associated_with_depth_error(0.15F, 0.0), 40U) << "the check is off";
}

TEST(LineAssociation, DoesWithoutDepth) {
  Pair p({.depth_share = 0.0});
  mapping().associate(p.map.map, p.right, p.tracked());
  EXPECT_EQ(p.united(), p.shown_twice.size());
}

TEST(LineCreation, MakesALineOfEverySegmentOfKnownDepth) {
  const LineWorld world;
  const LineView view = world.look(kRight, 3, {.depth_share = 0.7});
  Map map(kTestPyramid);
  const KeyframeId id = map.add_keyframe(view.frame, kRight, view.lines);
  const std::vector<LineId> created = mapping().create(map, id);
  EXPECT_EQ(created.size(), map.lines().size());
  std::size_t with = 0;
  for (std::size_t s = 0; s < view.sources.size(); ++s) {
    const LineId line = map.keyframes()[id].lines[s];
    ASSERT_EQ(line.valid(), view.lines->segments[s].depth.known());
    if (!line.valid()) continue;
    ++with;
    EXPECT_EQ(std::count(created.begin(), created.end(), line), 1);
    const Edge& edge = world.edge(view.sources[s]);
    // Float pixels and inverse depths, at 3 m.
    EXPECT_LT((map.lines()[line].start - edge.start).norm(), 1e-5);
    EXPECT_LT((map.lines()[line].end - edge.end).norm(), 1e-5);
    EXPECT_EQ(map.lines()[line].descriptor, edge.descriptor);
    EXPECT_EQ(map.lines()[line].contrast, edge.contrast);
  }
  EXPECT_EQ(created.size(), with);
  EXPECT_TRUE(with > 20 && with < view.sources.size() - 10) << "both kinds should have been there";
  expect_consistent(map);
}

TEST(LineCreation, LeavesSegmentsAloneThatHaveALine) {
  Pair p;
  mapping().associate(p.map.map, p.right, p.tracked());
  const std::size_t before = p.map.map.lines().size();
  const std::vector<LineId> created = mapping().create(p.map.map, p.right);
  EXPECT_EQ(created.size(), p.view.sources.size() - p.shown_twice.size());
  EXPECT_EQ(p.map.map.lines().size(), before + created.size());
  EXPECT_EQ(p.united(), p.shown_twice.size());
  EXPECT_TRUE(mapping().create(p.map.map, p.right).empty()) << "there is none left";
  expect_consistent(p.map.map);
}

// Lines made of one segment between two pixels with these inverse depths.
std::size_t lines_of(const Eigen::Vector2f& start, const Eigen::Vector2f& end, float w_start, float w_end) {
  LineFeatures features;
  LineSegment segment;
  segment.start = segment.start_pixel = start;
  segment.end = segment.end_pixel = end;
  segment.contrast = 50.0F;
  segment.depth.inverse_start = w_start;
  segment.depth.inverse_end = w_end;
  features.segments.push_back(segment);
  features.descriptors.resize(1);
  Map map(kTestPyramid);
  const KeyframeId id = map.add_keyframe(SyntheticWorld::make_frame({}), kLeft,
                                         std::make_shared<const LineFeatures>(std::move(features)));
  const std::size_t created = mapping().create(map, id).size();
  EXPECT_EQ(map.lines().size(), created);
  return created;
}

TEST(LineCreation, MakesNothingOfASegmentWithoutALine) {
  EXPECT_EQ(lines_of({100, 100}, {200, 100}, 0.5F, 0.4F), 1U);
  EXPECT_EQ(lines_of({100, 100}, {100, 100}, 0.5F, 0.5F), 0U) << "no length";
}

TEST(LineCreation, MakesNothingOfASegmentThatRunsAlongItsRay) {
  EXPECT_EQ(lines_of({100, 100}, {100, 100}, 0.5F, 0.4F), 0U) << "it would have no image";
}

// Keyframes side by side that see edges made for the occasion, and one edge all of them share, which makes
// them neighbours.
class Scene {
 public:
  // A keyframe that sees these edges, each as a line of its own.
  KeyframeId add(const SE3& T_cw, std::vector<Edge> edges) {
    edges.push_back(shared_);
    LineFeatures features;
    for (const Edge& edge : edges) {
      features.segments.push_back(exact_segment(kTestCamera, T_cw, edge));
      features.descriptors.push_back(edge.descriptor);
    }
    const std::size_t count = edges.size();
    const KeyframeId id = map.add_keyframe(SyntheticWorld::make_frame({}), T_cw,
                                           std::make_shared<const LineFeatures>(std::move(features)));
    for (std::uint32_t s = 0; s + 1 < count; ++s) add_line(edges[s], id, s);
    const auto last = static_cast<std::uint32_t>(count - 1);
    if (shared_line_.valid()) map.add_observation(shared_line_, id, last);
    if (!shared_line_.valid()) shared_line_ = add_line(shared_, id, last);
    return id;
  }
  [[nodiscard]] LineId line(KeyframeId keyframe, std::size_t segment = 0) const {
    return map.keyframes()[keyframe].lines[segment];
  }

  Map map{kTestPyramid};

 private:
  LineId add_line(const Edge& edge, KeyframeId id, std::uint32_t segment) {
    return map.add_line(*Line3::through(edge.start, edge.end), edge.start, edge.end, id, segment);
  }

  const Edge shared_{{-0.8, -0.6, 2.0}, {-0.8, 0.6, 2.0}};
  LineId shared_line_;
};

Edge level(double from, double to, double y = 0.0) {
  return {{from, y, 2.0}, {to, y, 2.0}};
}

// Whether the line the second keyframe sees is fused with that of the first.
bool fused(const Edge& seen_left, const Edge& seen_right) {
  Scene scene;
  const KeyframeId left = scene.add(kLeft, {seen_left}), right = scene.add(kRight, {seen_right});
  const LineId a = scene.line(left), b = scene.line(right);
  mapping().fuse(scene.map, right);
  expect_consistent(scene.map);
  const bool same = scene.map.resolve(a) == scene.map.resolve(b);
  EXPECT_EQ(scene.map.lines().size(), same ? 2U : 3U);
  return same;
}

TEST(LineFusion, JoinsPiecesOfOneEdge) {
  EXPECT_TRUE(fused(level(-0.3, 0.3), level(-0.3, 0.3))) << "twice the same";
  EXPECT_TRUE(fused(level(-0.3, 0.1), level(-0.1, 0.3))) << "they overlap";
  EXPECT_TRUE(fused(level(-0.3, 0.0), level(0.0, 0.3))) << "they touch";
  EXPECT_TRUE(fused(level(-0.4, 0.4), level(-0.1, 0.1))) << "one lies in the other";
}

TEST(LineFusion, LeavesWhatIsNotOneEdge) {
  EXPECT_FALSE(fused(level(-0.3, 0.3), level(-0.3, 0.3, 0.02))) << "2 cm beside it, 5 pixels";
  EXPECT_FALSE(fused(level(-0.5, -0.3), level(0.2, 0.4))) << "far apart on one line";
  EXPECT_FALSE(fused(level(-0.3, 0.3), level(0.3, -0.3))) << "the brighter side is the other one";
  EXPECT_FALSE(fused(level(-0.3, 0.3), {{-0.3, -0.04, 2.0}, {0.3, 0.04, 2.0}})) << "turned by eight degrees";
  EXPECT_FALSE(fused(level(-0.3, 0.3), {{-0.39, 0.0, 2.6}, {0.39, 0.0, 2.6}})) << "60 cm behind it";
}

TEST(LineFusion, TheLineCoversWhatBothShowed) {
  Scene scene;
  const KeyframeId left = scene.add(kLeft, {level(-0.3, 0.1)}), right = scene.add(kRight, {level(-0.1, 0.3)});
  const LineId a = scene.line(left), b = scene.line(right);
  mapping().fuse(scene.map, right);
  const LineId kept = scene.map.resolve(a);
  ASSERT_EQ(kept, scene.map.resolve(b));
  const Line& line = scene.map.lines()[kept];
  EXPECT_EQ(line.observations.size(), 2U);
  // Float pixels at 2 m.
  EXPECT_LT((line.start - Eigen::Vector3d(-0.3, 0.0, 2.0)).norm(), 1e-5);
  EXPECT_LT((line.end - Eigen::Vector3d(0.3, 0.0, 2.0)).norm(), 1e-5);
  expect_consistent(scene.map);
}

TEST(LineFusion, TwoThatOneKeyframeShowsApartStayApart) {
  Scene scene;
  const KeyframeId left = scene.add(kLeft, {level(-0.3, 0.0), level(0.01, 0.3)}),
                   right = scene.add(kRight, {level(-0.3, 0.0)});
  const LineId first = scene.line(left, 0), second = scene.line(left, 1), own = scene.line(right);
  mapping().fuse(scene.map, right);
  EXPECT_EQ(scene.map.resolve(own), scene.map.resolve(first));
  ASSERT_EQ(scene.map.resolve(second), second);
  EXPECT_EQ(scene.map.lines()[second].observations.size(), 1U);
  expect_consistent(scene.map);
}

TEST(LineFusion, TheOneSeenByMoreKeyframesStays) {
  Scene scene;
  const KeyframeId left = scene.add(kLeft, {level(-0.3, 0.3)}),
                   middle = scene.add(camera_at({0, 0, 0}), {level(-0.3, 0.3)}),
                   right = scene.add(kRight, {level(-0.3, 0.3)});
  const LineId popular = scene.line(left), lonely = scene.line(right);
  scene.map.fuse(popular, scene.line(middle));
  mapping().fuse(scene.map, right);
  EXPECT_EQ(scene.map.resolve(lonely), popular);
  EXPECT_EQ(scene.map.lines()[popular].observations.size(), 3U);
  expect_consistent(scene.map);
}

TEST(LineFusion, ThreePiecesBecomeOne) {
  Scene scene;
  const KeyframeId left = scene.add(kLeft, {level(-0.3, 0.1)}),
                   middle = scene.add(camera_at({0, 0, 0}), {level(0.0, 0.4)}),
                   right = scene.add(kRight, {level(-0.2, 0.3)});
  const LineId a = scene.line(left), b = scene.line(middle), c = scene.line(right);
  mapping().fuse(scene.map, right);
  EXPECT_EQ(scene.map.resolve(a), scene.map.resolve(c));
  EXPECT_EQ(scene.map.resolve(b), scene.map.resolve(c));
  EXPECT_EQ(scene.map.lines()[scene.map.resolve(c)].observations.size(), 3U);
  expect_consistent(scene.map);
}

TEST(LineFusion, DoingItAgainChangesNothing) {
  Pair p;
  const std::uint32_t known = p.shown_twice[5];
  p.map.map.add_observation(p.map.line_of(known), p.right,
                            static_cast<std::uint32_t>(p.view.segment_of(known)));
  (void)mapping().create(p.map.map, p.right);
  mapping().fuse(p.map.map, p.right);
  EXPECT_EQ(p.united(), p.shown_twice.size());
  const std::size_t lines = p.map.map.lines().size();
  mapping().fuse(p.map.map, p.right);
  EXPECT_EQ(p.map.map.lines().size(), lines);
  expect_consistent(p.map.map);
}

using Extent = std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>>;

// The extent of a line as keyframes at these poses show it, each a segment between two pixels.
struct Sight {
  SE3 T_cw;
  Eigen::Vector2f start, end;
};

Extent extent(const Line3& line, const std::vector<Sight>& sights) {
  Map map(kTestPyramid);
  std::vector<Observation> observations;
  for (const Sight& sight : sights) {
    LineFeatures features;
    features.segments.resize(1);
    features.segments[0].start = sight.start;
    features.segments[0].end = sight.end;
    features.descriptors.resize(1);
    observations.push_back({map.add_keyframe(SyntheticWorld::make_frame({}), sight.T_cw,
                                             std::make_shared<const LineFeatures>(std::move(features))),
                            0});
  }
  return observed_extent(map, kTestCamera, kTestNoise, line, observations);
}

Sight sight_of(const SE3& T_cw, const Eigen::Vector3d& start_w, const Eigen::Vector3d& end_w) {
  return {T_cw, kTestCamera.project(T_cw * start_w).cast<float>(),
          kTestCamera.project(T_cw * end_w).cast<float>()};
}

Line3 through(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return *Line3::through(a, b);
}

TEST(ObservedExtent, ReachesFromTheFirstEndSeenToTheLast) {
  const Eigen::Vector3d a(-0.4, 0.1, 2.0), b(-0.1, 0.15, 2.1), c(0.2, 0.2, 2.2), d(0.5, 0.25, 2.3);
  const Extent both = extent(through(a, d), {sight_of(kLeft, a, c), sight_of(kRight, b, d)});
  ASSERT_TRUE(both);
  // Float pixels at 2 m.
  EXPECT_LT((both->first - a).norm(), 1e-5);
  EXPECT_LT((both->second - d).norm(), 1e-5);
  const Extent one = extent(through(a, d), {sight_of(kRight, b, c)});
  ASSERT_TRUE(one);
  EXPECT_LT((one->first - b).norm(), 1e-5);
  EXPECT_LT((one->second - c).norm(), 1e-5);
}

TEST(ObservedExtent, RunsInTheDirectionOfTheLine) {
  const Eigen::Vector3d a(-0.4, 0.1, 2.0), b(0.5, 0.25, 2.3);
  const Extent backwards = extent(through(b, a), {sight_of(kLeft, a, b)});
  ASSERT_TRUE(backwards);
  EXPECT_LT((backwards->first - b).norm(), 1e-5);
  EXPECT_LT((backwards->second - a).norm(), 1e-5);
}

TEST(ObservedExtent, LiesOnTheLineEvenIfTheSegmentDoesNot) {
  const Eigen::Vector3d a(-0.4, 0.0, 2.0), b(0.4, 0.0, 2.0), below(0.0, 0.01, 0.0);
  const Line3 line = through(a, b);
  const Extent found = extent(line, {sight_of(SE3{}, a + below, b + below)});
  ASSERT_TRUE(found);
  EXPECT_LT(line.distance(found->first), 1e-9);
  EXPECT_LT(line.distance(found->second), 1e-9);
  EXPECT_LT((found->first - a).norm(), 1e-3);
  EXPECT_LT((found->second - b).norm(), 1e-3);
}

TEST(ObservedExtent, ThereIsNoneOfALineThroughTheCamera) {
  const Line3 line = through({0.0, 0.0, 0.0}, {0.2, 0.1, 1.0});
  EXPECT_FALSE(extent(line, {{SE3{}, {300, 240}, {500, 300}}}));
}

TEST(ObservedExtent, ThereIsNoneOfALineParallelToTheRays) {
  // The line runs along the optical axis, 5 cm beside it; so do the rays of both ends.
  const Line3 line = through({0.05, 0.0, 1.0}, {0.05, 0.0, 2.0});
  EXPECT_FALSE(extent(line, {{SE3{}, {319.5F, 239.5F}, {319.5F, 239.5F}}}));
}

TEST(ObservedExtent, ThereIsNoneOfALineBehindTheCamera) {
  const Eigen::Vector3d a(-0.4, 0.1, -2.0), b(0.4, 0.1, -2.0);
  EXPECT_FALSE(extent(through(a, b), {sight_of(SE3{}, a, b)}));
}

TEST(ObservedExtent, ThereIsNoneBeyondTheRangeOfDepth) {
  const Eigen::Vector3d a(-2.0, 0.1, 11.0), b(2.0, 0.1, 11.0);
  ASSERT_LT(kTestNoise.max_depth, 11.0);
  EXPECT_FALSE(extent(through(a, b), {sight_of(SE3{}, a, b)}));
}

TEST(ObservedExtent, ThereIsNoneWithoutObservations) {
  EXPECT_FALSE(extent(through({0, 0, 2}, {1, 0, 2}), {}));
}

TEST(ObservedExtent, OneGoodViewIsEnough) {
  const Eigen::Vector3d a(-0.4, 0.1, 2.0), b(0.4, 0.1, 2.0);
  // The second camera has the line behind it.
  const Extent found =
      extent(through(a, b), {sight_of(SE3{}, a, b), {camera_at({0.0, 0.0, 3.0}), {100, 200}, {300, 200}}});
  ASSERT_TRUE(found);
  EXPECT_LT((found->first - a).norm(), 1e-5);
  EXPECT_LT((found->second - b).norm(), 1e-5);
}

}  // namespace
}  // namespace ipl_slam
