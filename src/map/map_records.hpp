#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/byte_stream.hpp"
#include "map/map.hpp"

// The records of a map file, field by field. Each record is one function that both writes and reads, so that
// the two cannot differ: with a RecordWriter it puts the fields, with a RecordReader it takes them and checks
// that each lies in its range.
namespace ipl_slam {

/// No coordinate and no length is larger, metres or pixels: far beyond what is mapped, and squares of it do
/// not overflow.
inline constexpr double kFarthest = 1e9;
/// Frames that may count for a landmark: more than a year of them.
inline constexpr double kMostSightings = 1e9;

/// Characters that texts of a map file do not hold.
[[nodiscard]] inline bool is_control(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

class RecordWriter {
 public:
  template <std::unsigned_integral Stored, class T>
  void whole(const T& value, double, double, const char*) {
    out_.put(static_cast<Stored>(value));
  }
  template <std::floating_point T>
  void real(const T& value, double, double, const char*) {
    out_.put(value);
  }
  void descriptor(const Descriptor& descriptor) {
    for (const std::uint64_t word : descriptor) out_.put(word);
  }
  void pose(const SE3& T, const char*) {
    const Eigen::Quaterniond& q = T.rotation();
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) out_.put(value);
    for (int k = 0; k < 3; ++k) out_.put(T.translation()[k]);
  }
  void text(const std::string& text, const char*) {
    out_.put(static_cast<std::uint32_t>(text.size()));
    out_.put(std::string_view(text));
  }
  /// How many records follow, each of which takes at least so many bytes.
  std::uint32_t count(std::size_t records, std::size_t, const char*) {
    out_.put(static_cast<std::uint32_t>(records));
    return static_cast<std::uint32_t>(records);
  }

  [[nodiscard]] std::string take() { return out_.take(); }

 private:
  ByteWriter out_;
};

class RecordReader {
 public:
  explicit RecordReader(std::string_view bytes) : in_(bytes) {}

  template <std::unsigned_integral Stored, class T>
  void whole(T& value, double low, double high, const char* what) {
    const auto stored = in_.get<Stored>();
    check(static_cast<double>(stored), low, high, what);
    value = static_cast<T>(stored);
  }
  template <std::floating_point T>
  void real(T& value, double low, double high, const char* what) {
    value = in_.get<T>();
    check(value, low, high, what);
  }
  void descriptor(Descriptor& descriptor) {
    for (std::uint64_t& word : descriptor) word = in_.get<std::uint64_t>();
  }
  void pose(SE3& T, const char* what) {
    constexpr double kLengthTolerance = 1e-9;  // rounding, and what some thousand products of poses leave
    double q[4];
    for (double& value : q) real(value, -2.0, 2.0, what);
    Eigen::Vector3d t;
    for (int k = 0; k < 3; ++k) real(t[k], -kFarthest, kFarthest, what);
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    require(std::abs(rotation.norm() - 1.0) < kLengthTolerance, what, "has a rotation that is none");
    T = SE3::of_unit(rotation, t);
  }
  void text(std::string& text, const char* what) {
    const auto size = in_.get<std::uint32_t>();
    text = std::string(in_.get_bytes(size));
    require(std::none_of(text.begin(), text.end(), is_control), what,
            "holds characters that cannot be shown");
  }
  std::uint32_t count(std::size_t, std::size_t bytes_each, const char* what) {
    const auto records = in_.get<std::uint32_t>();
    require(records <= in_.remaining() / bytes_each, what, "are fewer than announced");
    return records;
  }

  /// Throws FormatError where `holds` is not so.
  static void require(bool holds, std::string_view what, std::string_view trouble) {
    if (!holds) throw FormatError(fmt::format("{} {}", what, trouble));
  }
  [[nodiscard]] const ByteReader& bytes() const { return in_; }

 private:
  static void check(double value, double low, double high, const char* what) {
    // Written so that NaN fails.
    if (!(value >= low && value <= high)) {
      throw FormatError(fmt::format("{} is {:g}, not from {:g} to {:g}", what, value, low, high));
    }
  }

  ByteReader in_;
};

/// A count and as many elements: `each` writes or reads one.
template <class Archive, class List, class Each>
void list_record(Archive& a, List& list, std::size_t bytes_each, const char* what, const Each& each) {
  const std::uint32_t count = a.count(list.size(), bytes_each, what);
  if constexpr (!std::is_const_v<List>) list.resize(count);
  for (auto& element : list) each(element);
}

template <class Archive, class Vector>
void vector_record(Archive& a, Vector& v, const char* what) {
  for (int k = 0; k < v.size(); ++k) a.real(v[k], -kFarthest, kFarthest, what);
}

/// Camera: everything Camera::check wants besides is left to it.
template <class Archive, class C>
void camera_record(Archive& a, C& camera) {
  a.text(camera.name, "the camera's name");
  a.template whole<std::uint32_t>(camera.width, 0, kFarthest, "the camera's width");
  a.template whole<std::uint32_t>(camera.height, 0, kFarthest, "the camera's height");
  for (auto* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy, &camera.k1, &camera.k2, &camera.p1,
                      &camera.p2, &camera.k3, &camera.depth_scale}) {
    a.real(*value, -kFarthest, kFarthest, "a number of the camera");
  }
}

inline constexpr std::size_t kKeypointBytes = 4 * 7 + 1 + 32;

template <class Archive, class K>
void keypoint_record(Archive& a, K& keypoint, int levels) {
  // A float may be a little more than two pi.
  constexpr double kTurn = static_cast<double>(2.0F * std::numbers::pi_v<float>);
  vector_record(a, keypoint.pixel, "a keypoint's position");
  vector_record(a, keypoint.undistorted, "a keypoint's position");
  a.real(keypoint.angle, 0.0, kTurn, "a keypoint's angle");
  a.real(keypoint.response, -kFarthest, kFarthest, "a keypoint's response");
  a.real(keypoint.depth, 0.0, kFarthest, "a keypoint's depth");
  a.template whole<std::uint8_t>(keypoint.level, 0, levels - 1, "a keypoint's level");
}

inline constexpr std::size_t kSegmentBytes = 4 * 8 + 4 + 1 + 4 * 5 + 32;

template <class Archive, class S>
void segment_record(Archive& a, S& segment) {
  constexpr double kMostOctaves = 15;  // smaller than any image
  for (auto* end : {&segment.start_pixel, &segment.end_pixel, &segment.start, &segment.end}) {
    vector_record(a, *end, "a segment's end");
  }
  a.real(segment.contrast, 0.0, kFarthest, "a segment's contrast");
  a.template whole<std::uint8_t>(segment.octave, 0, kMostOctaves, "a segment's octave");
  a.real(segment.depth.inverse_start, 0.0, kFarthest, "a segment's inverse depth");
  a.real(segment.depth.inverse_end, 0.0, kFarthest, "a segment's inverse depth");
  auto& covariance = segment.depth.covariance;
  a.real(covariance(0, 0), 0.0, kFarthest, "a segment's variance");
  a.real(covariance(0, 1), -kFarthest, kFarthest, "a segment's covariance");
  a.real(covariance(1, 1), 0.0, kFarthest, "a segment's variance");
  if constexpr (!std::is_const_v<S>) covariance(1, 0) = covariance(0, 1);
}

/// The two are index by index: all features, then all descriptors.
template <class Archive, class Items, class Descriptors, class Each>
void features_record(Archive& a, Items& items, Descriptors& descriptors, std::size_t bytes_each,
                     const char* what, const Each& each) {
  list_record(a, items, bytes_each, what, each);
  if constexpr (!std::is_const_v<Descriptors>) descriptors.resize(items.size());
  for (auto& descriptor : descriptors) a.descriptor(descriptor);
}

/// Whether there are weights, and one per feature.
template <class Archive, class Weights>
void weights_record(Archive& a, Weights& weights, std::size_t features) {
  std::uint8_t given = weights.empty() ? 0 : 1;
  a.template whole<std::uint8_t>(given, 0, features > 0 ? 1 : 0, "a mark of weights");
  if constexpr (!std::is_const_v<Weights>) weights.resize(given != 0 ? features : 0);
  for (auto& weight : weights) a.real(weight, 0.0, 1.0, "a feature's weight");
}

/// What is saved of a keyframe.
struct KeyframeRecord {
  SE3 T_cw;
  PartId part;
  std::size_t index = 0;
  double timestamp = 0.0;
  Features features;
  std::vector<double> point_weights;
  LineFeatures lines;
  std::vector<double> line_weights;
};

inline constexpr std::size_t kKeyframeBytes = 8 * 7 + 4 + 8 + 8 + 4 + 1 + 4 + 1;

template <class Archive, class K>
void keyframe_record(Archive& a, K& keyframe, int levels) {
  constexpr double kLargest = static_cast<double>(std::numeric_limits<std::uint64_t>::max());
  a.pose(keyframe.T_cw, "a keyframe's pose");
  a.template whole<std::uint32_t>(keyframe.part.value, 0, PartId::kInvalid, "a keyframe's part");
  a.template whole<std::uint64_t>(keyframe.index, 0, kLargest, "a keyframe's index");
  a.real(keyframe.timestamp, -kLargest, kLargest, "a keyframe's timestamp");
  features_record(a, keyframe.features.keypoints, keyframe.features.descriptors, kKeypointBytes,
                  "the keypoints", [&](auto& keypoint) { keypoint_record(a, keypoint, levels); });
  weights_record(a, keyframe.point_weights, keyframe.features.size());
  features_record(a, keyframe.lines.segments, keyframe.lines.descriptors, kSegmentBytes, "the segments",
                  [&](auto& segment) { segment_record(a, segment); });
  weights_record(a, keyframe.line_weights, keyframe.lines.size());
}

inline constexpr std::size_t kObservationBytes = 8, kLandmarkBytes = 4 * 4 + kObservationBytes;

/// What points and lines have in common.
template <class Archive, class Landmark>
void landmark_record(Archive& a, Landmark& landmark, std::size_t keyframes) {
  const double last = static_cast<double>(keyframes) - 1.0;
  a.template whole<std::uint32_t>(landmark.first_keyframe.value, 0, last, "a landmark's first keyframe");
  a.template whole<std::uint32_t>(landmark.visible, 1, kMostSightings, "a landmark's count");
  a.template whole<std::uint32_t>(landmark.found, 0, kMostSightings, "a landmark's count");
  list_record(a, landmark.observations, kObservationBytes, "the observations", [&](auto& observation) {
    a.template whole<std::uint32_t>(observation.keyframe.value, 0, last, "an observation's keyframe");
    a.template whole<std::uint32_t>(observation.feature, 0, PointId::kInvalid, "an observation's feature");
  });
}

inline constexpr std::size_t kPointBytes = 8 * 3 + kLandmarkBytes;

template <class Archive, class P>
void point_record(Archive& a, P& point, std::size_t keyframes) {
  vector_record(a, point.position, "a point's position");
  landmark_record(a, point, keyframes);
}

inline constexpr std::size_t kLineBytes = 8 * 12 + kLandmarkBytes;

template <class Archive, class L>
void line_record(Archive& a, L& line, std::size_t keyframes) {
  for (auto* vector : {&line.line.moment, &line.line.direction, &line.start, &line.end}) {
    vector_record(a, *vector, "a line's place");
  }
  landmark_record(a, line, keyframes);
}

inline constexpr std::size_t kLoopBytes = 2 * 4 + 8 * 7;

template <class Archive, class Edge>
void loop_record(Archive& a, Edge& edge, std::size_t keyframes) {
  const double last = static_cast<double>(keyframes) - 1.0;
  for (auto* keyframe : {&edge.a, &edge.b}) {
    a.template whole<std::uint32_t>(keyframe->value, 0, last, "a loop's keyframe");
  }
  a.pose(edge.T_ab, "a loop's pose");
}

}  // namespace ipl_slam
