#pragma once

#include "map/map.hpp"
#include "support/synthetic_world.hpp"
#include "tracking/tracked_frame.hpp"

namespace ipl_slam::test {

/// A view on its way into the map that knows no landmark: at `T_c_reference` to a keyframe, or, without one,
/// as the first of a part, at its true pose.
inline KeyframeCandidate candidate(const View& view, KeyframeId reference = {},
                                   const SE3& T_c_reference = {}) {
  KeyframeCandidate result;
  TrackedFrame& tracked = result.tracked;
  tracked.frame = view.frame;
  tracked.state = TrackingState::kTracking;
  tracked.T_cw = view.T_cw;
  tracked.reference = reference;
  tracked.T_c_reference = T_c_reference;
  tracked.points.resize(view.sources.size());
  return result;
}

/// A frame that could not be placed.
inline TrackedFrame lost_frame(const View& view) {
  TrackedFrame lost;
  lost.frame = view.frame;
  lost.state = TrackingState::kLost;
  lost.points.resize(view.sources.size());
  return lost;
}

/// A camera among points on all sides that makes every frame a keyframe. What its odometry says of a step is
/// right but where an error is asked for.
class KeyframeWalk {
 public:
  /// Views of this many degrees apart show nothing of each other.
  static constexpr double kElsewhere = 120.0;

  explicit KeyframeWalk(std::uint64_t seed = 5) : world_(seed, 4000, {-5.0, -2.0, -5.0}, {5.0, 2.0, 5.0}) {}

  /// What a camera sees that looks `degrees` to the side, from the i-th of some positions 10 cm apart.
  [[nodiscard]] View look(double degrees, int i) { return world_.look(pose(degrees, i), frames_++); }
  [[nodiscard]] static SE3 pose(double degrees, int i) {
    return camera_at({0.1 * i, 0.0, 0.0}, degrees * std::numbers::pi / 180.0);
  }
  /// The next keyframe of the same part, with the landmarks that the one before saw and it sees as well.
  [[nodiscard]] KeyframeCandidate step(const View& view, const Map& map, const SE3& error = {}) {
    KeyframeCandidate next = candidate(view, last_, error * view.T_cw * last_view_.T_cw.inverse());
    for (std::size_t k = 0; k < view.sources.size(); ++k) {
      const int there = last_view_.keypoint_of(view.sources[k]);
      if (there >= 0) next.tracked.points[k] = map.keyframes()[last_].points[static_cast<std::size_t>(there)];
    }
    went_to(view);
    return next;
  }
  /// The first keyframe of a part.
  [[nodiscard]] KeyframeCandidate start(const View& view) {
    went_to(view);
    return candidate(view);
  }

 private:
  void went_to(const View& view) {
    last_ = KeyframeId{next_++};
    last_view_ = view;
  }

  SyntheticWorld world_;
  std::size_t frames_ = 0;
  std::uint32_t next_ = 0;
  KeyframeId last_;
  View last_view_;
};

}  // namespace ipl_slam::test
