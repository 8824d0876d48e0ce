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

// Adds the keyframe's lines; milliseconds. Does nothing without an extractor or where they are there already.
double extract_lines(std::optional<LineExtractor>& extractor, NewKeyframe& keyframe) {
  if (!extractor || keyframe.candidate.lines) return 0.0;
  const Stopwatch stopwatch;
  keyframe.candidate.lines =
      std::make_shared<const LineFeatures>(extractor->extract(keyframe.grey, keyframe.depth));
  return stopwatch.milliseconds();
}

class LockstepMapping final : public MappingSchedule {
 public:
  LockstepMapping(LocalMapper mapper, std::optional<LineExtractor> lines)
      : mapper_(std::move(mapper)), lines_(std::move(lines)) {}

  void start(NewKeyframe first) override { submit(std::move(first)); }
  void submit(NewKeyframe keyframe) override {
    MappingTime time{.frame_index = keyframe.candidate.tracked.frame->index};
    time.lines = extract_lines(lines_, keyframe);
    const Stopwatch stopwatch;
    local_map_ = mapper_.process(keyframe.candidate);
    time.mapping = stopwatch.milliseconds();
    times_.push_back(time);
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
  std::optional<LineExtractor> lines_;
  std::shared_ptr<const LocalMap> local_map_;
  std::vector<MappingTime> times_;
};

class RealtimeMapping final : public MappingSchedule {
 public:
  RealtimeMapping(LocalMapper mapper, std::optional<LineExtractor> lines, std::size_t queue_size)
      : mapper_(std::move(mapper)),
        lines_(std::move(lines)),
        queue_size_(queue_size),
        line_queue_(queue_size),
        mapper_queue_(queue_size),
        line_thread_([this] { find_lines(); }),
        mapper_thread_([this] { map_keyframes(); }) {}

  ~RealtimeMapping() override {
    {
      std::lock_guard lock(state_mutex_);
      stopping_ = true;
      abort_bundle_ = true;
    }
    line_queue_.close();
    line_thread_.join();
    mapper_queue_.close();
    mapper_thread_.join();
  }

  void start(NewKeyframe first) override {
    submit(std::move(first));
    finish();
  }

  void submit(NewKeyframe keyframe) override {
    {
      std::lock_guard lock(state_mutex_);
      if (failure_) std::rethrow_exception(failure_);
      ++pending_;
      abort_bundle_ = pending_ > 1;
    }
    line_queue_.push(std::move(keyframe));
  }

  [[nodiscard]] std::shared_ptr<const LocalMap> local_map() const override {
    std::lock_guard lock(state_mutex_);
    return local_map_;
  }
  [[nodiscard]] bool idle() const override {
    std::lock_guard lock(state_mutex_);
    return pending_ == 0;
  }
  [[nodiscard]] bool has_room() const override { return line_queue_.size() < queue_size_; }

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
  struct WithLines {
    KeyframeCandidate candidate;
    double milliseconds;
  };

  void find_lines() {
    while (auto keyframe = line_queue_.pop()) {
      try {
        const double milliseconds = extract_lines(lines_, *keyframe);
        mapper_queue_.push({std::move(keyframe->candidate), milliseconds});
      } catch (...) {
        done_with_one(nullptr, std::current_exception());
      }
    }
  }

  void map_keyframes() {
    while (auto next = mapper_queue_.pop()) {
      std::shared_ptr<const LocalMap> local_map;
      std::exception_ptr failure;
      try {
        std::lock_guard lock(map_mutex_);
        const Stopwatch stopwatch;
        local_map = mapper_.process(next->candidate, &abort_bundle_);
        times_.push_back(
            {next->candidate.tracked.frame->index, next->milliseconds, stopwatch.milliseconds()});
      } catch (...) {
        failure = std::current_exception();
      }
      done_with_one(std::move(local_map), failure);
    }
  }

  void done_with_one(std::shared_ptr<const LocalMap> local_map, std::exception_ptr failure) {
    std::lock_guard lock(state_mutex_);
    if (local_map) local_map_ = std::move(local_map);
    if (failure) failure_ = failure;
    --pending_;
    abort_bundle_ = stopping_ || pending_ > 1;
    done_.notify_all();
  }

  LocalMapper mapper_;              // guarded by map_mutex_
  std::vector<MappingTime> times_;  // guarded by map_mutex_
  mutable std::mutex map_mutex_;
  std::optional<LineExtractor> lines_;  // used by the line thread alone

  std::shared_ptr<const LocalMap>
      local_map_;  // guarded by state_mutex_, as are pending_, stopping_, failure_
  int pending_ = 0;
  bool stopping_ = false;
  std::exception_ptr failure_;
  mutable std::mutex state_mutex_;
  std::condition_variable done_;

  std::atomic<bool> abort_bundle_ = false;
  std::size_t queue_size_;
  BoundedQueue<NewKeyframe> line_queue_;
  BoundedQueue<WithLines> mapper_queue_;
  std::thread line_thread_, mapper_thread_;  // last: they start when everything else is there
};

}  // namespace

std::unique_ptr<MappingSchedule> make_lockstep_mapping(LocalMapper mapper,
                                                       std::optional<LineExtractor> lines) {
  return std::make_unique<LockstepMapping>(std::move(mapper), std::move(lines));
}

std::unique_ptr<MappingSchedule> make_realtime_mapping(LocalMapper mapper, std::optional<LineExtractor> lines,
                                                       std::size_t queue_size) {
  return std::make_unique<RealtimeMapping>(std::move(mapper), std::move(lines), queue_size);
}

}  // namespace ipl_slam
