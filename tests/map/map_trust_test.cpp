// How far the map trusts the features of its keyframes.

#include <gtest/gtest.h>

#include "map/local_map.hpp"
#include "support/bare_frame.hpp"
#include "support/map_checks.hpp"

namespace ipl_slam {
namespace {

using namespace test;

std::shared_ptr<const LineFeatures> bare_lines(std::size_t segments) {
  LineFeatures lines;
  lines.segments.resize(segments);
  lines.descriptors.resize(segments);
  return std::make_shared<const LineFeatures>(std::move(lines));
}

// Two keyframes of four keypoints and four segments. In the second, keypoint 1 and segment 2 are removed.
struct TwoKeyframes {
  TwoKeyframes() {
    before = map.add_keyframe(bare_frame(4), camera_at({0.0, 0.0, 0.0}), bare_lines(4));
    now = map.add_keyframe(bare_frame(4), camera_at({0.1, 0.0, 0.0}), bare_lines(4), point_trust, line_trust);
    point = map.add_point({0.0, 0.0, 2.0}, before, 0);
    line = map.add_line(*Line3::through(start, end), start, end, before, 0);
  }

  const Eigen::Vector3d start{-0.5, 0.2, 2.0}, end{0.5, 0.1, 2.5};
  const FeatureTrust point_trust{{1.0, 0.0, 0.1, 1.0},
                                 {InstanceId{}, InstanceId{3}, InstanceId{}, InstanceId{}}};
  const FeatureTrust line_trust{{1.0, 0.25, 0.0, 1.0},
                                {InstanceId{}, InstanceId{}, InstanceId{3}, InstanceId{}}};
  Map map{kTestPyramid};
  KeyframeId before, now;
  PointId point;
  LineId line;
};

TEST(MapTrust, StaysWithItsKeyframe) {
  const TwoKeyframes s;
  const Keyframe& keyframe = s.map.keyframes()[s.now];
  EXPECT_EQ(keyframe.point_trust.weights, s.point_trust.weights);
  EXPECT_EQ(keyframe.point_trust.regions, s.point_trust.regions);
  EXPECT_EQ(keyframe.line_trust.weights, s.line_trust.weights);
  EXPECT_EQ(keyframe.line_trust.regions, s.line_trust.regions);
  EXPECT_EQ(s.map.keyframes()[s.before].point_trust.weight(3), 1.0) << "full, unless told otherwise";
  EXPECT_FALSE(s.map.keyframes()[s.before].line_trust.region(3).valid());
}

TEST(MapTrust, ARemovedFeatureIsNoObservation) {
  TwoKeyframes s;
  s.map.add_observation(s.point, s.now, 1);
  s.map.add_observation(s.line, s.now, 2);
  EXPECT_EQ(s.map.points()[s.point].observations.size(), 1U);
  EXPECT_EQ(s.map.lines()[s.line].observations.size(), 1U);
  EXPECT_FALSE(s.map.keyframes()[s.now].points[1].valid());
  EXPECT_FALSE(s.map.keyframes()[s.now].lines[2].valid());
  expect_consistent(s.map);
}

TEST(MapTrust, AFeatureThatCountsALittleIsOne) {
  TwoKeyframes s;
  s.map.add_observation(s.point, s.now, 2);
  s.map.add_observation(s.line, s.now, 1);
  EXPECT_EQ(s.map.keyframes()[s.now].points[2], s.point);
  EXPECT_EQ(s.map.keyframes()[s.now].lines[1], s.line);
  EXPECT_EQ(s.map.points()[s.point].observations.size(), 2U);
  EXPECT_EQ(s.map.lines()[s.line].observations.size(), 2U);
  expect_consistent(s.map);
}

TEST(MapTrust, PointsAndSegmentsAreToldApart) {
  TwoKeyframes s;
  s.map.add_observation(s.point, s.now, 2);  // as a segment it is removed
  s.map.add_observation(s.line, s.now, 1);   // as a keypoint it is removed
  EXPECT_TRUE(s.map.observes(s.now, s.point));
  EXPECT_TRUE(s.map.observes(s.now, s.line));
}

TEST(MapTrust, TheTrackerTrustsALineAsTheNewestKeyframeDoesThatSeesIt) {
  TwoKeyframes s;
  const auto weight = [&] { return build_local_map(s.map, s.now, {}).lines.at(0).weight; };
  EXPECT_EQ(weight(), 1.0);
  s.map.add_observation(s.line, s.now, 1);
  EXPECT_EQ(weight(), 0.25);
}

}  // namespace
}  // namespace ipl_slam
