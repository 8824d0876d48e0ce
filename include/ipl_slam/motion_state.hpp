#pragma once

namespace ipl_slam {

/// Whether an instance in the picture moves.
enum class MotionState {
  kCandidate,  ///< not judged yet
  kStill,
  kMoving,
};

}  // namespace ipl_slam
