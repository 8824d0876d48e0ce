#pragma once

namespace ipl_slam {

/// What the tracker knows about the camera after a frame.
enum class TrackingState {
  kInitializing,  ///< no map yet: no frame so far had enough features with depth
  kTracking,      ///< the pose of this frame was found
  kLost,  ///< the map exists, but this frame could not be placed in it; its pose is the last one known
};

/// "initializing", "tracking" or "lost".
[[nodiscard]] inline const char* to_string(TrackingState state) {
  switch (state) {
    case TrackingState::kInitializing:
      return "initializing";
    case TrackingState::kTracking:
      return "tracking";
    case TrackingState::kLost:
      return "lost";
  }
  return "?";
}

}  // namespace ipl_slam
