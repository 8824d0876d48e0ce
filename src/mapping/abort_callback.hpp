#pragma once

#include <atomic>

#include <ceres/iteration_callback.h>

namespace ipl_slam {

/// Ends a Ceres solve between two steps once a flag is raised; null = never.
class AbortCallback final : public ceres::IterationCallback {
 public:
  explicit AbortCallback(const std::atomic<bool>* abort) : abort_(abort) {}
  [[nodiscard]] bool raised() const { return abort_ && abort_->load(std::memory_order_relaxed); }

  // Ceres hands back the best state only after a "successful" end.
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return raised() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const std::atomic<bool>* abort_;
};

}  // namespace ipl_slam
