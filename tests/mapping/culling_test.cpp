#include "mapping/culling.hpp"

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "support/world_map.hpp"

namespace ipl_slam {
namespace {

using namespace test;

CullingOptions options() {
  CullingOptions result;
  result.min_found_ratio = 0.25;
  result.probation = 2;
  result.min_observations = 2;
  result.redundant_share = 0.9;
  result.redundant_observers = 3;
  return result;
}

std::shared_ptr<const Frame> frame_with(std::size_t keypoints, int level = 0) {
  Features features;
  features.keypoints.resize(keypoints);
  features.descriptors.resize(keypoints);
  for (Keypoint& keypoint : features.keypoints) keypoint.level = level;
  return SyntheticWorld::make_frame(std::move(features));
}

struct Probation {
  Probation() { add_keyframe(); }
  void add_keyframe() { newest = map.add_keyframe(frame_with(10), SE3{}); }
  PointId watched_point(std::uint32_t keypoint) {
    const PointId id = map.add_point({0.0, 0.0, 2.0}, newest, keypoint);
    culling.watch(id);
    return id;
  }
  Map map{kTestPyramid};
  LandmarkCulling<PointId> culling{options()};
  KeyframeId newest;
};

TEST(LandmarkCulling, RemovesWhatIsRarelyFoundAtOnce) {
  Probation p;
  const PointId rare = p.watched_point(0), common = p.watched_point(1);
  p.map.count_sightings(rare, 7, 0);    // 1 of 8
  p.map.count_sightings(common, 7, 1);  // 2 of 8: the limit
  p.culling.cull(p.map);
  EXPECT_FALSE(p.map.points().contains(rare));
  EXPECT_TRUE(p.map.points().contains(common));
  expect_consistent(p.map);
}

TEST(LandmarkCulling, RemovesWhatNoOtherKeyframeSawByTheEndOfItsProbation) {
  Probation p;
  const PointId alone = p.watched_point(0), confirmed = p.watched_point(1);
  p.add_keyframe();
  p.map.add_observation(confirmed, p.newest, 0);
  p.culling.cull(p.map);
  EXPECT_TRUE(p.map.points().contains(alone)) << "still on probation";
  p.add_keyframe();
  p.culling.cull(p.map);
  EXPECT_FALSE(p.map.points().contains(alone));
  EXPECT_TRUE(p.map.points().contains(confirmed));
  expect_consistent(p.map);
}

TEST(LandmarkCulling, WhatPassedIsLeftAlone) {
  Probation p;
  const PointId id = p.watched_point(0);
  p.add_keyframe();
  p.map.add_observation(id, p.newest, 0);
  p.add_keyframe();
  p.culling.cull(p.map);
  p.map.count_sightings(id, 1000, 0);
  p.culling.cull(p.map);
  EXPECT_TRUE(p.map.points().contains(id));
}

TEST(LandmarkCulling, WhatIsNotWatchedIsLeftAlone) {
  Probation p;
  const PointId id = p.map.add_point({0.0, 0.0, 2.0}, p.newest, 0);
  p.map.count_sightings(id, 1000, 0);
  p.culling.cull(p.map);
  EXPECT_TRUE(p.map.points().contains(id));
}

TEST(LandmarkCulling, ForgetsLandmarksThatAreGone) {
  Probation p;
  const PointId removed = p.watched_point(0), fused = p.watched_point(1), kept = p.watched_point(2);
  p.map.remove(removed);
  p.map.fuse(kept, fused);
  p.culling.cull(p.map);
  EXPECT_TRUE(p.map.points().contains(kept));
  expect_consistent(p.map);
}

// Keyframes that all see the same points, keypoint i for point i, at one level each.
struct Crowd {
  explicit Crowd(const std::vector<int>& levels, std::uint32_t points = 20) {
    for (const int level : levels) {
      keyframes.push_back(map.add_keyframe(frame_with(points + 5, level), SE3{}));
    }
    for (std::uint32_t k = 0; k < points; ++k) {
      const PointId id = map.add_point({0.1 * k, 0.0, 2.0}, keyframes[0], k);
      for (std::size_t i = 1; i < keyframes.size(); ++i) map.add_observation(id, keyframes[i], k);
    }
  }
  void cull(const CullingOptions& culling = options()) { cull_keyframes(map, keyframes.back(), culling); }
  [[nodiscard]] std::vector<std::uint32_t> left() const {
    std::vector<std::uint32_t> ids;
    map.keyframes().for_each([&](KeyframeId id, const Keyframe&) { ids.push_back(id.value); });
    return ids;
  }
  Map map{kTestPyramid};
  std::vector<KeyframeId> keyframes;
};

TEST(KeyframeCulling, RedundantKeyframesGoWhileEnoughOthersSeeTheirPoints) {
  Crowd crowd({0, 0, 0, 0, 0, 0});
  crowd.cull();
  // 1, 2 and 3 go in turn: 3 still has three others beside it, 4 then only two.
  EXPECT_EQ(crowd.left(), (std::vector<std::uint32_t>{0, 4, 5}));
  expect_consistent(crowd.map);
}

TEST(KeyframeCulling, NeverTakesTheFirstOrTheNewest) {
  Crowd crowd({0, 0, 0, 0});
  CullingOptions greedy = options();
  greedy.redundant_observers = 1;
  crowd.cull(greedy);
  EXPECT_EQ(crowd.left(), (std::vector<std::uint32_t>{0, 3}));
  // Nor where the newest is a neighbour of the centre.
  cull_keyframes(crowd.map, crowd.keyframes[0], greedy);
  EXPECT_EQ(crowd.left(), (std::vector<std::uint32_t>{0, 3}));
}

TEST(KeyframeCulling, AKeyframeWithPointsOfItsOwnStays) {
  Crowd crowd({0, 0, 0, 0, 0, 0});
  // 2 and 3 see two further points alone: 20 of 22 is more than nine tenths; three: 20 of 23 is less.
  for (std::uint32_t k = 20; k < 22; ++k) crowd.map.add_point({0.0, 1.0, 2.0}, crowd.keyframes[2], k);
  for (std::uint32_t k = 20; k < 23; ++k) crowd.map.add_point({0.0, 1.0, 2.0}, crowd.keyframes[3], k);
  crowd.cull();
  EXPECT_FALSE(crowd.map.keyframes().contains(crowd.keyframes[2]));
  EXPECT_TRUE(crowd.map.keyframes().contains(crowd.keyframes[3]));
}

TEST(KeyframeCulling, ViewsThatAreMuchCoarserDoNotReplaceAFineOne) {
  Crowd coarser({2, 0, 2, 2, 2, 2});
  coarser.cull();
  EXPECT_TRUE(coarser.map.keyframes().contains(coarser.keyframes[1]));
  Crowd as_fine({1, 0, 1, 1, 1, 1});
  as_fine.cull();
  EXPECT_FALSE(as_fine.map.keyframes().contains(as_fine.keyframes[1])) << "one level is no difference";
}

TEST(KeyframeCulling, AboveOneMeansNever) {
  Crowd crowd({0, 0, 0, 0, 0, 0});
  CullingOptions never = options();
  never.redundant_share = 1.01;
  crowd.cull(never);
  EXPECT_EQ(crowd.left().size(), 6U);
}

std::shared_ptr<const LineFeatures> segments_of(std::size_t count, int octave = 0) {
  LineFeatures lines;
  lines.segments.resize(count);
  lines.descriptors.resize(count);
  for (LineSegment& segment : lines.segments) segment.octave = octave;
  return std::make_shared<const LineFeatures>(std::move(lines));
}

LineId add_line(Map& map, KeyframeId keyframe, std::uint32_t segment) {
  const Eigen::Vector3d start(-0.5, 0.0, 2.0), end(0.5, 0.0, 2.0);
  return map.add_line(*Line3::through(start, end), start, end, keyframe, segment);
}

struct LineProbation {
  LineProbation() { add_keyframe(); }
  void add_keyframe() { newest = map.add_keyframe(frame_with(0), SE3{}, segments_of(10)); }
  LineId watched_line(std::uint32_t segment) {
    const LineId id = add_line(map, newest, segment);
    culling.watch(id);
    return id;
  }
  Map map{kTestPyramid};
  LandmarkCulling<LineId> culling{options()};
  KeyframeId newest;
};

TEST(LineCulling, RemovesWhatIsRarelyFoundAtOnce) {
  LineProbation p;
  const LineId rare = p.watched_line(0), common = p.watched_line(1);
  p.map.count_sightings(rare, 7, 0);    // 1 of 8
  p.map.count_sightings(common, 7, 1);  // 2 of 8: the limit
  p.culling.cull(p.map);
  EXPECT_FALSE(p.map.lines().contains(rare));
  EXPECT_TRUE(p.map.lines().contains(common));
  expect_consistent(p.map);
}

TEST(LineCulling, RemovesWhatNoOtherKeyframeSawByTheEndOfItsProbation) {
  LineProbation p;
  const LineId alone = p.watched_line(0), confirmed = p.watched_line(1);
  p.add_keyframe();
  p.map.add_observation(confirmed, p.newest, 0);
  p.culling.cull(p.map);
  EXPECT_TRUE(p.map.lines().contains(alone)) << "still on probation";
  p.add_keyframe();
  p.culling.cull(p.map);
  EXPECT_FALSE(p.map.lines().contains(alone));
  EXPECT_TRUE(p.map.lines().contains(confirmed));
  p.map.count_sightings(confirmed, 1000, 0);
  p.culling.cull(p.map);
  EXPECT_TRUE(p.map.lines().contains(confirmed)) << "what passed is left alone";
  expect_consistent(p.map);
}

// Six keyframes that all see the same lines, segment i for line i, on one octave each, and no points.
struct LineCrowd {
  static constexpr std::uint32_t kLines = 20;

  explicit LineCrowd(const std::vector<int>& octaves = {0, 0, 0, 0, 0, 0}) {
    for (const int octave : octaves) {
      keyframes.push_back(map.add_keyframe(frame_with(5), SE3{}, segments_of(kLines + 5, octave)));
    }
    for (std::uint32_t s = 0; s < kLines; ++s) {
      const LineId id = add_line(map, keyframes[0], s);
      for (std::size_t i = 1; i < keyframes.size(); ++i) map.add_observation(id, keyframes[i], s);
    }
  }
  void cull() { cull_keyframes(map, keyframes.back(), options()); }
  [[nodiscard]] bool has(std::size_t i) const { return map.keyframes().contains(keyframes[i]); }

  Map map{kTestPyramid};
  std::vector<KeyframeId> keyframes;
};

TEST(KeyframeCulling, KeyframesOfTheSameLinesAreRedundantToo) {
  LineCrowd crowd;
  crowd.cull();
  // As with points: each of 1, 2 and 3 still has three others beside it when its turn comes.
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(crowd.has(i), i == 0 || i >= 4) << "keyframe " << i;
  expect_consistent(crowd.map);
}

TEST(KeyframeCulling, AKeyframeWhoseLinesNobodyElseSeesStays) {
  LineCrowd crowd;
  // 20 of 22 is more than nine tenths; 20 of 23 is less.
  for (std::uint32_t s = 20; s < 22; ++s) add_line(crowd.map, crowd.keyframes[2], s);
  for (std::uint32_t s = 20; s < 23; ++s) add_line(crowd.map, crowd.keyframes[3], s);
  crowd.cull();
  EXPECT_FALSE(crowd.has(2));
  EXPECT_TRUE(crowd.has(3));
}

TEST(KeyframeCulling, LinesOfItsOwnKeepAKeyframeWhosePointsAllOthersSee) {
  Crowd crowd({0, 0, 0, 0, 0});
  const auto add_keyframe = [&](std::uint32_t own_lines) {
    const KeyframeId id = crowd.map.add_keyframe(frame_with(25), SE3{}, segments_of(5));
    for (std::uint32_t k = 0; k < 20; ++k) {
      crowd.map.add_observation(crowd.map.keyframes()[crowd.keyframes[0]].points[k], id, k);
    }
    for (std::uint32_t s = 0; s < own_lines; ++s) add_line(crowd.map, id, s);
    crowd.keyframes.push_back(id);
    return id;
  };
  const KeyframeId with_lines = add_keyframe(4), without = add_keyframe(0);
  crowd.cull();  // around the one without lines, which is the newest
  EXPECT_TRUE(crowd.map.keyframes().contains(without));
  EXPECT_TRUE(crowd.map.keyframes().contains(with_lines));
  EXPECT_LT(crowd.left().size(), 5U) << "others did go";
}

TEST(KeyframeCulling, SegmentsThatAreMuchCoarserDoNotReplaceFineOnes) {
  LineCrowd coarser({2, 0, 2, 2, 2, 2});
  coarser.cull();
  EXPECT_TRUE(coarser.has(1));
  LineCrowd as_fine({1, 0, 1, 1, 1, 1});
  as_fine.cull();
  EXPECT_FALSE(as_fine.has(1)) << "one octave is no difference";
}

}  // namespace
}  // namespace ipl_slam
