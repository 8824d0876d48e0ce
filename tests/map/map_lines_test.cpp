// The map's line landmarks.

#include <gtest/gtest.h>

#include "map/map.hpp"
#include "support/bare_frame.hpp"
#include "support/map_checks.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Segments that have nothing to do with each other.
std::shared_ptr<const LineFeatures> bare_lines(std::size_t segments) {
  LineFeatures lines;
  lines.segments.resize(segments);
  lines.descriptors.resize(segments);
  Random random(segments + 1);
  for (std::size_t i = 0; i < segments; ++i) {
    lines.segments[i].contrast = static_cast<float>(random.uniform(10.0, 100.0));
    for (auto& word : lines.descriptors[i]) word = random.bits();
  }
  return std::make_shared<const LineFeatures>(std::move(lines));
}

// Keyframes in a row along x, a metre apart, looking along z, with keypoints and segments.
struct RowWithLines {
  explicit RowWithLines(int count, std::size_t segments = 20) {
    for (int i = 0; i < count; ++i) {
      const SE3 T_cw = camera_at({1.0 * i, 0.0, 0.0});
      keyframes.push_back(map.add_keyframe(bare_frame(20), T_cw, bare_lines(segments)));
    }
  }
  LineId add(int keyframe, std::uint32_t segment) {
    return map.add_line(*Line3::through(start, end), start, end, keyframes[keyframe], segment);
  }
  // A line seen by these keyframes (indices into the row), at the next free segment of each.
  LineId line(const std::vector<int>& observers) {
    LineId id;
    for (const int i : observers) {
      const std::uint32_t segment = next[static_cast<std::size_t>(i)]++;
      if (id.valid()) map.add_observation(id, keyframes[i], segment);
      if (!id.valid()) id = add(i, segment);
    }
    return id;
  }
  [[nodiscard]] std::vector<std::uint32_t> observers_of(LineId id) const {
    std::vector<std::uint32_t> result;
    for (const Observation& o : map.lines()[id].observations) result.push_back(o.keyframe.value);
    return result;
  }

  const Eigen::Vector3d start{-0.5, 0.2, 2.0}, end{0.5, 0.1, 2.5};
  Map map{kTestPyramid};
  std::vector<KeyframeId> keyframes;
  std::vector<std::uint32_t> next = std::vector<std::uint32_t>(100, 0);
};

TEST(MapLines, StartWithTheirFirstObservation) {
  RowWithLines row(2);
  const LineId id = row.add(0, 7);
  EXPECT_EQ(row.map.keyframes()[row.keyframes[0]].lines[7], id);
  EXPECT_TRUE(row.map.observes(row.keyframes[0], id));
  EXPECT_FALSE(row.map.observes(row.keyframes[1], id));
  EXPECT_EQ(row.map.lines()[id].first_keyframe, row.keyframes[1]) << "the newest when it was made";
  EXPECT_EQ(row.map.lines()[id].start, row.start);
  EXPECT_EQ(row.map.lines()[id].end, row.end);
  EXPECT_EQ(row.map.lines()[id].visible, 1);
  EXPECT_EQ(row.map.lines()[id].found, 1);
  expect_consistent(row.map);
}

TEST(MapLines, AreObservedInOrderOfKeyframeAndOncePerKeyframe) {
  RowWithLines row(4);
  const LineId id = row.line({2, 0, 3, 1});
  row.map.add_observation(id, row.keyframes[1], 9);
  EXPECT_EQ(row.observers_of(id), (std::vector<std::uint32_t>{0, 1, 2, 3}));
  EXPECT_FALSE(row.map.keyframes()[row.keyframes[1]].lines[9].valid());
  expect_consistent(row.map);
}

TEST(MapLines, ASegmentSeesOneLine) {
  RowWithLines row(2);
  const LineId first = row.line({0}), second = row.line({1});
  row.map.add_observation(second, row.keyframes[0], 0);
  EXPECT_EQ(row.map.keyframes()[row.keyframes[0]].lines[0], first);
  EXPECT_EQ(row.observers_of(second), (std::vector<std::uint32_t>{1}));
  expect_consistent(row.map);
}

TEST(MapLines, DieWithTheirLastObservation) {
  RowWithLines row(2);
  const LineId id = row.line({0, 1});
  row.map.remove_observation(id, row.keyframes[0]);
  EXPECT_TRUE(row.map.lines().contains(id));
  expect_consistent(row.map);
  row.map.remove_observation(id, row.keyframes[1]);
  EXPECT_FALSE(row.map.lines().contains(id));
  EXPECT_FALSE(row.map.resolve(id).valid());
  expect_consistent(row.map);
}

TEST(MapLines, AndPointsDoNotShareIds) {
  RowWithLines row(2);
  const LineId line = row.line({0});
  const PointId point = row.map.add_point({0.0, 0.0, 2.0}, row.keyframes[0], 0);
  ASSERT_EQ(line.value, point.value);
  row.map.remove(line);
  EXPECT_TRUE(row.map.points().contains(point));
  EXPECT_EQ(row.map.keyframes()[row.keyframes[0]].points[0], point);
  EXPECT_FALSE(row.map.keyframes()[row.keyframes[0]].lines[0].valid());
  expect_consistent(row.map);
}

TEST(MapLines, FusingMovesObservationsAndSightings) {
  RowWithLines row(4);
  const LineId kept = row.line({0, 1}), gone = row.line({1, 2, 3});
  row.map.count_sightings(kept, 4, 3);
  row.map.count_sightings(gone, 20, 10);
  row.map.fuse(kept, gone);
  EXPECT_EQ(row.observers_of(kept), (std::vector<std::uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(row.map.keyframes()[row.keyframes[1]].lines[0], kept) << "its own segment stays";
  EXPECT_FALSE(row.map.keyframes()[row.keyframes[1]].lines[1].valid());
  EXPECT_EQ(row.map.lines()[kept].visible, 5 + 21);
  EXPECT_EQ(row.map.lines()[kept].found, 4 + 11);
  EXPECT_FALSE(row.map.lines().contains(gone));
  EXPECT_EQ(row.map.resolve(gone), kept);
  expect_consistent(row.map);
}

TEST(MapLines, ResolveThroughAChainOfFusions) {
  RowWithLines row(3);
  const LineId a = row.line({0}), b = row.line({1}), c = row.line({2});
  row.map.fuse(b, a);
  row.map.fuse(c, b);
  for (const LineId id : {a, b, c}) EXPECT_EQ(row.map.resolve(id), c);
  row.map.remove(c);
  for (const LineId id : {a, b, c}) EXPECT_FALSE(row.map.resolve(id).valid());
  EXPECT_FALSE(row.map.resolve(LineId{}).valid());
}

TEST(MapLines, GoWithTheOnlyKeyframeThatSawThem) {
  RowWithLines row(3);
  const LineId shared = row.line({0, 1}), own = row.line({1});
  row.map.remove_keyframe(row.keyframes[1]);
  EXPECT_FALSE(row.map.lines().contains(own));
  EXPECT_EQ(row.observers_of(shared), (std::vector<std::uint32_t>{0}));
  expect_consistent(row.map);
}

TEST(MapLines, MakeKeyframesCovisibleTogetherWithPoints) {
  RowWithLines row(4);
  row.line({0, 2});
  row.line({0, 2});
  row.line({0, 1});
  const PointId point = row.map.add_point({0.0, 0.0, 2.0}, row.keyframes[0], 0);
  row.map.add_observation(point, row.keyframes[1], 0);
  row.map.add_observation(point, row.keyframes[2], 0);
  const auto covisible = row.map.covisible(row.keyframes[0]);
  ASSERT_EQ(covisible.size(), 2U);
  EXPECT_EQ(covisible[0].keyframe, row.keyframes[2]);
  EXPECT_EQ(covisible[0].shared, 3) << "two lines and a point";
  EXPECT_EQ(covisible[1].keyframe, row.keyframes[1]);
  EXPECT_EQ(covisible[1].shared, 2);
}

TEST(MapLines, HoldTheParentOfARemovedKeyframe) {
  RowWithLines row(3);
  row.line({0, 1});
  row.map.remove_keyframe(row.keyframes[1]);  // shares a line with 0 and nothing with the newest
  row.map.set_pose(row.keyframes[0], camera_at({0.0, 5.0, 0.0}));
  EXPECT_LT(pose_difference(row.map.pose_of(row.keyframes[1]), camera_at({1.0, 5.0, 0.0})), 1e-12);
}

TEST(MapLines, AKeyframeMayComeWithoutLineFeatures) {
  RowWithLines row(1);
  const KeyframeId id = row.map.add_keyframe(bare_frame(3), SE3{});
  ASSERT_TRUE(row.map.keyframes()[id].line_features);
  EXPECT_EQ(row.map.keyframes()[id].line_features->size(), 0U);
  EXPECT_TRUE(row.map.keyframes()[id].lines.empty());
  expect_consistent(row.map);
}

TEST(MapLines, TakeOverAnotherPlace) {
  RowWithLines row(1);
  const LineId id = row.line({0});
  const Eigen::Vector3d start(0.0, 0.0, 3.0), end(0.0, 1.0, 3.0);
  row.map.set_line(id, *Line3::through(start, end), start, end);
  EXPECT_EQ(row.map.lines()[id].start, start);
  EXPECT_EQ(row.map.lines()[id].end, end);
  expect_consistent(row.map);
}

TEST(MapLines, RefreshAveragesTheContrastAndTakesTheTypicalDescriptor) {
  Map map{kTestPyramid};
  LineId id;
  const Eigen::Vector3d start(0.0, 0.0, 2.0), end(1.0, 0.0, 2.0);
  for (const std::uint64_t bits : {0xFFFFULL, 0x0ULL, 0x1ULL}) {
    LineFeatures lines;
    lines.segments.resize(1);
    lines.segments[0].contrast = bits == 0xFFFF ? 60.0F : 30.0F;
    lines.descriptors.push_back({bits, 0, 0, 0});
    const KeyframeId keyframe =
        map.add_keyframe(bare_frame(0), SE3{}, std::make_shared<const LineFeatures>(std::move(lines)));
    if (id.valid()) map.add_observation(id, keyframe, 0);
    if (!id.valid()) id = map.add_line(*Line3::through(start, end), start, end, keyframe, 0);
  }
  EXPECT_EQ(map.lines()[id].contrast, 60.0F);
  map.refresh(id);
  EXPECT_EQ(map.lines()[id].descriptor, (Descriptor{0x0, 0, 0, 0}));
  EXPECT_FLOAT_EQ(map.lines()[id].contrast, 40.0F);
}

TEST(MapLines, StayConsistentUnderRandomChanges) {
  constexpr int kSegments = 12;
  RowWithLines row(0);
  Random random(5);
  std::vector<LineId> lines;
  std::vector<KeyframeId>& keyframes = row.keyframes;
  const auto any = [&](const auto& ids) { return ids[random.index(ids.size())]; };
  for (int step = 0; step < 600; ++step) {
    const std::uint64_t choice = keyframes.size() < 3 ? 0 : random.index(12);
    const LineId line = lines.empty() ? LineId{} : row.map.resolve(any(lines));
    const auto segment = static_cast<std::uint32_t>(random.index(kSegments));
    if (choice == 0 && keyframes.size() < 40) {
      keyframes.push_back(row.map.add_keyframe(bare_frame(2), SE3{}, bare_lines(kSegments)));
    } else if (choice < 5) {
      const auto keyframe = static_cast<int>(random.index(keyframes.size()));
      if (!row.map.keyframes()[keyframes[keyframe]].lines[segment].valid()) {
        lines.push_back(row.add(keyframe, segment));
      }
    } else if (choice < 8 && line.valid()) {
      row.map.add_observation(line, any(keyframes), segment);
    } else if (choice == 8 && line.valid()) {
      row.map.remove_observation(line, any(keyframes));
    } else if (choice == 9 && line.valid()) {
      const LineId other = row.map.resolve(any(lines));
      if (other.valid()) row.map.fuse(line, other);
    } else if (choice == 10 && step % 5 == 0 && line.valid()) {
      row.map.remove(line);
    } else if (choice == 11 && keyframes.size() > 5) {
      const std::size_t i = 1 + random.index(keyframes.size() - 2);  // neither the anchor nor the newest
      row.map.remove_keyframe(keyframes[i]);
      keyframes.erase(keyframes.begin() + static_cast<std::ptrdiff_t>(i));
    }
    if (step % 10 == 0) expect_consistent(row.map);
    if (HasFatalFailure()) return;
  }
  expect_consistent(row.map);
  EXPECT_GT(row.map.lines().size(), 20U) << "the walk should end with a map worth checking";
}

}  // namespace
}  // namespace ipl_slam
