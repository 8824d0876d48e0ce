#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

#include "common/bounded_queue.hpp"
#include "dataset/rgbd_frame.hpp"

namespace ipl_slam {

/// Plays another source at the speed it was recorded: each item comes when its timestamp says. Where the
/// reader is late the oldest waiting frame is dropped; next() reports it as skipped with the reason kLate.
class RealtimeSource : public RgbdSource {
 public:
  static constexpr const char* kLate = "dropped, tracking was late";

  /// `queue` frames may wait. Playing starts with the first call of next().
  RealtimeSource(std::unique_ptr<RgbdSource> inner, std::size_t queue);
  ~RealtimeSource() override;

  [[nodiscard]] std::optional<SourceItem> next() override;
  [[nodiscard]] std::size_t size() const override { return inner_->size(); }

 private:
  void play();
  [[nodiscard]] std::optional<SourceItem> take_dropped();

  std::unique_ptr<RgbdSource> inner_;
  BoundedQueue<SourceItem> queue_;
  std::mutex mutex_;
  std::condition_variable stopped_;
  bool stop_ = false;               // guarded by mutex_
  std::deque<SourceItem> dropped_;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace ipl_slam
