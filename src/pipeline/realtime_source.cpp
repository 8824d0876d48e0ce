#include "pipeline/realtime_source.hpp"

#include <algorithm>
#include <utility>

namespace ipl_slam {

RealtimeSource::RealtimeSource(std::unique_ptr<RgbdSource> inner, std::size_t queue,
                               std::function<bool()> stop)
    : inner_(std::move(inner)), asked_to_stop_(std::move(stop)), queue_(queue) {}

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
  if (auto item = take_dropped()) return item;
  std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  return std::nullopt;
}

std::optional<SourceItem> RealtimeSource::take_dropped() {
  std::lock_guard lock(mutex_);
  if (dropped_.empty()) return std::nullopt;
  std::optional<SourceItem> item = std::move(dropped_.front());
  dropped_.pop_front();
  return item;
}

void RealtimeSource::play() {
  try {
    play_all();
  } catch (...) {
    std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
  queue_.close();
}

// False when playing shall end.
bool RealtimeSource::wait_until(std::chrono::steady_clock::time_point due) {
  constexpr std::chrono::milliseconds asking_interval(50);
  std::unique_lock lock(mutex_);
  while (!stop_) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= due) return true;
    if (asked_to_stop_ && asked_to_stop_()) return false;
    stopped_.wait_until(lock, std::min(due, now + asking_interval));
  }
  return false;
}

void RealtimeSource::play_all() {
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
    if (!wait_until(due)) return;
    if (auto late = queue_.push_dropping_oldest(std::move(*item))) {
      if (late->frame) {
        late->frame.reset();
        late->skip_reason = kLate;
      }
      std::lock_guard lock(mutex_);
      dropped_.push_back(std::move(*late));
    }
  }
}

}  // namespace ipl_slam
