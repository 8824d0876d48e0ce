#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "common/bounded_queue.hpp"
#include "dataset/rgbd_frame.hpp"

namespace ipl_slam {

/// Plays another source at the speed it was recorded: each item comes when its timestamp says. Where the
/// reader is late the oldest waiting frame is dropped; next() reports it as skipped with the reason kLate. An
/// exception of the other source is thrown by next() after what came before it, and ends the sequence.
class RealtimeSource : public RgbdSource {
 public:
  static constexpr const char* kLate = "dropped, tracking was late";

  /// `queue` frames may wait. Playing starts with the first call of next(). `stop` is asked again and again
  /// while the next frame is not due yet; true ends the sequence, so that a pause in the recording does not
  /// have to be sat out.
  RealtimeSource(std::unique_ptr<RgbdSource> inner, std::size_t queue, std::function<bool()> stop = {});
  ~RealtimeSource() override;

  [[nodiscard]] std::optional<SourceItem> next() override;
  [[nodiscard]] std::size_t size() const override { return inner_->size(); }

 private:
  void play();
  void play_all();
  [[nodiscard]] bool wait_until(std::chrono::steady_clock::time_point due);
  [[nodiscard]] std::optional<SourceItem> take_dropped();

  std::unique_ptr<RgbdSource> inner_;
  std::function<bool()> asked_to_stop_;
  BoundedQueue<SourceItem> queue_;
  std::mutex mutex_;
  std::condition_variable stopped_;
  bool stop_ = false;               // guarded by mutex_
  std::deque<SourceItem> dropped_;  // guarded by mutex_
  std::exception_ptr failure_;      // of inner_; guarded by mutex_
  std::thread thread_;
};

}  // namespace ipl_slam
