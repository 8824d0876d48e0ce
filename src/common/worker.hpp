#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "common/bounded_queue.hpp"

namespace ipl_slam {

/// A thread that works off one job at a time: a new one is taken only when the one before is done.
template <class Job>
class Worker {
 public:
  explicit Worker(std::function<void(Job&)> work) : work_(std::move(work)), thread_([this] { run(); }) {}
  /// Waits for the job under way.
  ~Worker() {
    queue_.close();
    thread_.join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Throws what the last job threw.
  [[nodiscard]] bool idle() const {
    std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    return !busy_;
  }
  /// Only while idle.
  void start(Job job) {
    {
      std::lock_guard lock(mutex_);
      busy_ = true;
    }
    queue_.push(std::move(job));
  }
  /// Waits until it is idle. Throws what the last job threw.
  void wait() const {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return !busy_; });
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void run() {
    while (auto job = queue_.pop()) {
      std::exception_ptr failure;
      try {
        work_(*job);
      } catch (...) {
        failure = std::current_exception();
      }
      std::lock_guard lock(mutex_);
      if (failure) failure_ = failure;
      busy_ = false;
      done_.notify_all();
    }
  }

  std::function<void(Job&)> work_;
  mutable std::mutex mutex_;
  mutable std::condition_variable done_;
  bool busy_ = false;  // guarded by mutex_, as is failure_
  std::exception_ptr failure_;
  BoundedQueue<Job> queue_{1};
  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace ipl_slam
