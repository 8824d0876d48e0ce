#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "dataset/rgbd_frame.hpp"

namespace ipl_slam {

/// Reads another source ahead on a thread of its own, so that images are decoded while earlier ones are
/// worked on. Gives exactly the items of the inner source, in its order; an exception of the inner source is
/// thrown by next() at the place where it happened, and ends the sequence. next() is for one thread at a
/// time.
class PrefetchingSource : public RgbdSource {
 public:
  /// Items read ahead at most. Decoding a frame takes about as long as tracking it, so a few even out the
  /// hiccups.
  static constexpr std::size_t kDefaultCapacity = 4;

  /// Takes the source and starts to read. `capacity` is at least 1 (0 counts as 1).
  explicit PrefetchingSource(std::unique_ptr<RgbdSource> inner, std::size_t capacity = kDefaultCapacity);
  /// Stops reading, wherever it is; waits for at most the one item being read.
  ~PrefetchingSource() override;
  PrefetchingSource(const PrefetchingSource&) = delete;
  PrefetchingSource& operator=(const PrefetchingSource&) = delete;

  [[nodiscard]] std::optional<SourceItem> next() override;
  [[nodiscard]] std::size_t size() const override { return size_; }

 private:
  void read_ahead();

  std::unique_ptr<RgbdSource> inner_;  // the thread's own once it runs
  const std::size_t size_;
  const std::size_t capacity_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SourceItem> queue_;  // guarded by mutex_, as are the next three
  std::exception_ptr failure_;    // of the inner source; comes after the queue's items
  bool finished_ = false;         // the inner source has no more
  bool abandoned_ = false;        // nobody will ask for more
  std::thread thread_;            // last: starts when all else is there
};

}  // namespace ipl_slam
