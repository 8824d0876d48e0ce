#include "dataset/prefetching_source.hpp"

#include <algorithm>
#include <utility>

namespace ipl_slam {

PrefetchingSource::PrefetchingSource(std::unique_ptr<RgbdSource> inner, std::size_t capacity)
    : inner_(std::move(inner)),
      size_(inner_->size()),
      capacity_(std::max<std::size_t>(capacity, 1)),
      thread_([this] { read_ahead(); }) {}

PrefetchingSource::~PrefetchingSource() {
  {
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PrefetchingSource::read_ahead() {
  while (true) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return abandoned_ || queue_.size() < capacity_; });
      if (abandoned_) return;
    }
    std::optional<SourceItem> item;
    std::exception_ptr failure;
    try {
      item = inner_->next();
    } catch (...) {
      failure = std::current_exception();
    }
    const bool more = item.has_value();
    {
      const std::lock_guard lock(mutex_);
      if (more) queue_.push_back(std::move(*item));
      failure_ = std::move(failure);
      finished_ = !more;
    }
    changed_.notify_all();
    if (!more) return;
  }
}

std::optional<SourceItem> PrefetchingSource::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return finished_ || !queue_.empty(); });
  if (queue_.empty()) {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return std::nullopt;
  }
  SourceItem item = std::move(queue_.front());
  queue_.pop_front();
  lock.unlock();
  changed_.notify_all();
  return item;
}

}  // namespace ipl_slam
