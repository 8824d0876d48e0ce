#include "pipeline/mapping_schedule.hpp"

#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "common/bounded_queue.hpp"
#include "common/stopwatch.hpp"

namespace ipl_slam {
namespace {

class LockstepMapping final : public MappingSchedule {
 public:
  explicit LockstepMapping(LocalMapper mapper) : mapper_(std::move(mapper)) {}

  void start(KeyframeCandidate first) override { submit(std::move(first)); }
  void submit(KeyframeCandidate candidate) override {
    const Stopwatch stopwatch;
    local_map_ = mapper_.process(candidate);
    times_.push_back({candidate.tracked.frame->index, stopwatch.milliseconds()});
  }
  [[nodiscard]] std::shared_ptr<const LocalMap> local_map() const override { return local_map_; }
  [[nodiscard]] bool idle() const override { return true; }
  [[nodiscard]] bool has_room() const override { return true; }
  void finish() override {}
  void read(const std::function<void(const Map&, const std::vector<MappingTime>&)>& fn) const override {
    fn(mapper_.map(), times_);
  }

 private:
  LocalMapper mapper_;
  std::shared_ptr<const LocalMap> local_map_;
  std::vector<MappingTime> times_;
};

class RealtimeMapping final : public MappingSchedule {
 public:
  RealtimeMapping(LocalMapper mapper, std::size_t queue_size)
      : mapper_(std::move(mapper)),
        queue_size_(queue_size),
        queue_(queue_size),
        thread_([this] { work(); }) {}

  ~RealtimeMapping() override {
    {
      std::lock_guard lock(state_mutex_);
      stopping_ = true;
      abort_bundle_ = true;
    }
    queue_.close();
    thread_.join();
  }

  void start(KeyframeCandidate first) override {
    submit(std::move(first));
    finish();
  }

  void submit(KeyframeCandidate candidate) override {
    {
      std::lock_guard lock(state_mutex_);
      if (failure_) std::rethrow_exception(failure_);
      ++pending_;
      abort_bundle_ = pending_ > 1;
    }
    queue_.push(std::move(candidate));
  }

  [[nodiscard]] std::shared_ptr<const LocalMap> local_map() const override {
    std::lock_guard lock(state_mutex_);
    return local_map_;
  }
  [[nodiscard]] bool idle() const override {
    std::lock_guard lock(state_mutex_);
    return pending_ == 0;
  }
  [[nodiscard]] bool has_room() const override { return queue_.size() < queue_size_; }

  void finish() override {
    std::unique_lock lock(state_mutex_);
    done_.wait(lock, [&] { return pending_ == 0; });
    if (failure_) std::rethrow_exception(failure_);
  }

  void read(const std::function<void(const Map&, const std::vector<MappingTime>&)>& fn) const override {
    std::lock_guard lock(map_mutex_);
    fn(mapper_.map(), times_);
  }

 private:
  void work() {
    while (auto candidate = queue_.pop()) {
      std::shared_ptr<const LocalMap> local_map;
      std::exception_ptr failure;
      try {
        std::lock_guard lock(map_mutex_);
        const Stopwatch stopwatch;
        local_map = mapper_.process(*candidate, &abort_bundle_);
        times_.push_back({candidate->tracked.frame->index, stopwatch.milliseconds()});
      } catch (...) {
        failure = std::current_exception();
      }
      std::lock_guard lock(state_mutex_);
      if (local_map) local_map_ = std::move(local_map);
      if (failure) failure_ = failure;
      --pending_;
      abort_bundle_ = stopping_ || pending_ > 1;
      done_.notify_all();
    }
  }

  LocalMapper mapper_;              // guarded by map_mutex_
  std::vector<MappingTime> times_;  // guarded by map_mutex_
  mutable std::mutex map_mutex_;

  std::shared_ptr<const LocalMap>
      local_map_;  // guarded by state_mutex_, as are pending_, stopping_, failure_
  int pending_ = 0;
  bool stopping_ = false;
  std::exception_ptr failure_;
  mutable std::mutex state_mutex_;
  std::condition_variable done_;

  std::atomic<bool> abort_bundle_ = false;
  std::size_t queue_size_;
  BoundedQueue<KeyframeCandidate> queue_;
  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace

std::unique_ptr<MappingSchedule> make_lockstep_mapping(LocalMapper mapper) {
  return std::make_unique<LockstepMapping>(std::move(mapper));
}

std::unique_ptr<MappingSchedule> make_realtime_mapping(LocalMapper mapper, std::size_t queue_size) {
  return std::make_unique<RealtimeMapping>(std::move(mapper), queue_size);
}

}  // namespace ipl_slam
