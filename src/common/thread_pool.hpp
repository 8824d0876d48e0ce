#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace ipl_slam {

/// A fixed set of threads that share loops. Which thread runs which index is not defined, so a loop body
/// writes to places that belong to its index alone; reductions happen afterwards, in the order of the
/// indices. Used this way, results do not depend on the number of threads.
class ThreadPool {
 public:
  /// `threads` counts the calling thread: 1 starts none and runs everything inline.
  /// Throws std::invalid_argument below 1.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  /// Threads that work on a loop, the caller included.
  [[nodiscard]] int size() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls fn(0) ... fn(count - 1), spread over the threads, and returns when all have ended. Every index
  /// runs even if some throw; the exception of the lowest index is then rethrown. Calls from several threads
  /// queue up; a call from inside a loop body runs inline.
  void parallel_for(std::size_t count, const std::function<void(std::size_t)>& fn);

 private:
  struct Job;

  void work();

  std::mutex submit_mutex_;  // held for the length of one loop, so that only one runs at a time
  std::mutex mutex_;         // guards job_, stop_ and Job::helpers
  std::condition_variable wake_;
  std::condition_variable idle_;
  Job* job_ = nullptr;
  bool stop_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace ipl_slam
