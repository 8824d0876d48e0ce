#include "pipeline/realtime_source.hpp"

#include <chrono>

namespace ipl_slam {

RealtimeSource::RealtimeSource(std::unique_ptr<RgbdSource> inner, std::size_t queue)
    : inner_(std::move(inner)), queue_(queue) {}

RealtimeSource::~RealtimeSource() {
  {
    std::lock_guard lock(mutex_);
    stop_ = true;
    stopped_.notify_all();
  }
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

std::optional<SourceItem> RealtimeSource::next() {
  if (!thread_.joinable()) thread_ = std::thread([this] { play(); });
  if (auto item = take_dropped()) return item;
  if (auto item = queue_.pop()) return item;
  return take_dropped();
}

std::optional<SourceItem> RealtimeSource::take_dropped() {
  std::lock_guard lock(mutex_);
  if (dropped_.empty()) return std::nullopt;
  std::optional<SourceItem> item = std::move(dropped_.front());
  dropped_.pop_front();
  return item;
}

void RealtimeSource::play() {
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> start;
  double first = 0.0;
  while (auto item = inner_->next()) {
    if (!start) {
      start = Clock::now();
      first = item->timestamp;
    }
    const auto due = *start + std::chrono::duration_cast<Clock::duration>(
                                  std::chrono::duration<double>(item->timestamp - first));
    {
      std::unique_lock lock(mutex_);
      if (stopped_.wait_until(lock, due, [&] { return stop_; })) return;
    }
    if (auto late = queue_.push_dropping_oldest(std::move(*item))) {
      if (late->frame) {
        late->frame.reset();
        late->skip_reason = kLate;
      }
      std::lock_guard lock(mutex_);
      dropped_.push_back(std::move(*late));
    }
  }
  queue_.close();
}

}  // namespace ipl_slam
