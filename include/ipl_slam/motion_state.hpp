#pragma once

namespace ipl_slam {

/// Whether an instance in the picture moves.
enum class MotionState {
  kCandidate,  ///< not judged yet
  kStill,
  kMoving,
};

/// "candidate", "still" or "moving".
[[nodiscard]] inline const char* to_string(MotionState state) {
  switch (state) {
    case MotionState::kCandidate:
      return "candidate";
    case MotionState::kStill:
      return "still";
    case MotionState::kMoving:
      return "moving";
  }
  return "?";
}

}  // namespace ipl_slam
