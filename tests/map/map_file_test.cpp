// Saving and loading a map.
#include "map/map_file.hpp"

#include <algorithm>
#include <csignal>
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "dataset/temporary_folder.hpp"
#include "map/map_bytes.hpp"
#include "support/map_checks.hpp"
#include "support/saved_map.hpp"

namespace ipl_slam {
namespace {

using namespace test;
using ::testing::AllOf;
using testing::content_of;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

void expect_equal(const Features& a, const Features& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.descriptors, b.descriptors);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint &k = a.keypoints[i], &l = b.keypoints[i];
    EXPECT_EQ(k.pixel, l.pixel);
    EXPECT_EQ(k.undistorted, l.undistorted);
    EXPECT_EQ(k.angle, l.angle);
    EXPECT_EQ(k.response, l.response);
    EXPECT_EQ(k.depth, l.depth);
    EXPECT_EQ(k.level, l.level);
  }
}

void expect_equal(const LineFeatures& a, const LineFeatures& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.descriptors, b.descriptors);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const LineSegment &s = a.segments[i], &t = b.segments[i];
    EXPECT_EQ(s.start_pixel, t.start_pixel);
    EXPECT_EQ(s.end_pixel, t.end_pixel);
    EXPECT_EQ(s.start, t.start);
    EXPECT_EQ(s.end, t.end);
    EXPECT_EQ(s.contrast, t.contrast);
    EXPECT_EQ(s.octave, t.octave);
    EXPECT_EQ(s.depth.inverse_start, t.depth.inverse_start);
    EXPECT_EQ(s.depth.inverse_end, t.depth.inverse_end);
    EXPECT_EQ(s.depth.covariance, t.depth.covariance);
  }
}

void expect_equal(const SE3& a, const SE3& b) {
  EXPECT_EQ(a.rotation().coeffs(), b.rotation().coeffs());
  EXPECT_EQ(a.translation(), b.translation());
}

/// The n-th record that there is.
template <class Id, class Record>
const Record& nth(const Store<Id, Record>& store, std::size_t n) {
  const Record* found = nullptr;
  store.for_each([&](Id, const Record& record) {
    if (n-- == 0) found = &record;
  });
  return *found;
}

template <class Landmark>
void expect_equal_landmarks(const Map& saved, const Landmark& a, const Landmark& b) {
  EXPECT_EQ(a.visible, b.visible);
  EXPECT_EQ(a.found, b.found);
  EXPECT_EQ(a.descriptor, b.descriptor);
  ASSERT_EQ(a.observations.size(), b.observations.size());
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    EXPECT_EQ(a.observations[i].feature, b.observations[i].feature);
    const Keyframe& seen_by = nth(saved.keyframes(), b.observations[i].keyframe.value);
    EXPECT_EQ(&saved.keyframes()[a.observations[i].keyframe], &seen_by) << "ids count anew in their order";
  }
}

// All that goes on: every number is the same to the bit.
void expect_equal(const Map& saved, const Map& loaded) {
  ASSERT_EQ(saved.keyframes().size(), loaded.keyframes().size());
  ASSERT_EQ(saved.points().size(), loaded.points().size());
  ASSERT_EQ(saved.lines().size(), loaded.lines().size());
  EXPECT_EQ(saved.pyramid().levels(), loaded.pyramid().levels());
  EXPECT_EQ(saved.pyramid().factor(), loaded.pyramid().factor());
  const std::vector<PartId> parts = saved.parts();
  ASSERT_EQ(parts.size(), loaded.parts().size());
  loaded.keyframes().for_each([&](KeyframeId id, const Keyframe& b) {
    const Keyframe& a = nth(saved.keyframes(), id.value);
    expect_equal(a.T_cw, b.T_cw);
    EXPECT_EQ(a.part, parts[b.part.value]);
    EXPECT_EQ(saved.anchor(a.part) == nth(saved.keyframes(), 0).points.front().value, false);
    EXPECT_EQ(a.frame->index, b.frame->index);
    EXPECT_EQ(a.frame->timestamp, b.frame->timestamp);
    expect_equal(a.frame->features, b.frame->features);
    expect_equal(*a.line_features, *b.line_features);
    EXPECT_EQ(a.point_trust.weights, b.point_trust.weights);
    EXPECT_EQ(a.line_trust.weights, b.line_trust.weights);
    EXPECT_TRUE(b.point_trust.regions.empty()) << "instance ids mean something within one run only";
  });
  loaded.points().for_each([&](PointId id, const Point& b) {
    const Point& a = nth(saved.points(), id.value);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.normal, b.normal);
    EXPECT_EQ(a.min_distance, b.min_distance);
    EXPECT_EQ(a.max_distance, b.max_distance);
    expect_equal_landmarks(saved, a, b);
  });
  loaded.lines().for_each([&](LineId id, const Line& b) {
    const Line& a = nth(saved.lines(), id.value);
    EXPECT_EQ(a.line.moment, b.line.moment);
    EXPECT_EQ(a.line.direction, b.line.direction);
    EXPECT_EQ(a.start, b.start);
    EXPECT_EQ(a.end, b.end);
    EXPECT_EQ(a.contrast, b.contrast);
    expect_equal_landmarks(saved, a, b);
  });
}
}  // namespace
}  // namespace ipl_slam
