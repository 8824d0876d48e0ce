#pragma once

#include <chrono>

namespace ipl_slam {

/// Wall-clock time since it was made or restarted, in milliseconds.
class Stopwatch {
 public:
  [[nodiscard]] double milliseconds() const {
    return std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
  }
  /// Time since the last restart; starts anew.
  double restart() {
    const double elapsed = milliseconds();
    start_ = Clock::now();
    return elapsed;
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace ipl_slam
