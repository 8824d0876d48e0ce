#include "pipeline/realtime_mapping.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "common/bounded_queue.hpp"
#include "common/stopwatch.hpp"
#include "common/worker.hpp"

namespace ipl_slam {
namespace {

class RealtimeMapping final : public MappingSchedule {
 public:
  RealtimeMapping(MapKeeper keeper, std::optional<KeyframeLines> lines, std::size_t queue_size)
      : keeper_(std::move(keeper)),
        lines_(std::move(lines)),
        local_map_(keeper_.around_newest()),
        queue_size_(queue_size),
        line_queue_(queue_size),
        mapper_queue_(1),
        place_worker_([this](PlaceRequest& request) { answer(request); }),
        bundle_worker_([this](GlobalBundle& bundle) { settle(bundle); }),
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
    abort_global_ = true;
  }

  void start(NewKeyframe first) override {
    submit(std::move(first));
    wait_for_mapper();
  }

  void submit(NewKeyframe keyframe) override {
    {
      std::lock_guard lock(state_mutex_);
      if (failure_) std::rethrow_exception(failure_);
      ++pending_;
      found_.reset();  // the camera is no longer lost
    }
    line_queue_.push(std::move(keyframe));
  }

  [[nodiscard]] std::shared_ptr<const LocalMap> local_map() const override {
    std::lock_guard lock(state_mutex_);
    if (failure_) std::rethrow_exception(failure_);
    return local_map_;
  }
  [[nodiscard]] bool idle() const override {
    std::lock_guard lock(state_mutex_);
    return pending_ == 0;
  }
  // One is worked on, the others wait.
  [[nodiscard]] bool has_room() const override {
    std::lock_guard lock(state_mutex_);
    return pending_ <= queue_size_;
  }

  [[nodiscard]] std::vector<RegionLines> take_region_lines() override {
    std::lock_guard lock(state_mutex_);
    return std::exchange(region_lines_, {});
  }

  // A search under way, or one that waits for the mapper, is enough: the next lost frame asks again.
  [[nodiscard]] std::optional<FoundPlace> find_place(const TrackedFrame& lost) override {
    {
      std::lock_guard lock(state_mutex_);
      if (found_) return std::exchange(found_, std::nullopt);
    }
    if (place_worker_.idle()) place_worker_.start({std::make_shared<const TrackedFrame>(lost), KeyframeId{}});
    return std::nullopt;
  }
  void resume_at(const FoundPlace& place) override {
    std::lock_guard lock(state_mutex_);
    local_map_ = place.map;
    found_events_.push_back(place.event);
  }
  void move_to(KeyframeId id) override {
    if (place_worker_.idle()) place_worker_.start({nullptr, id});
  }

  void finish() override {
    wait_for_mapper();
    place_worker_.wait();
    bundle_worker_.wait();
    // One that a later loop cut short is made up for.
    std::lock_guard map_lock(map_mutex_);
    while (keeper_.wants_global_bundle()) {
      GlobalBundle bundle = keeper_.begin_global_bundle();
      bundle.solve();
      apply(bundle);
    }
  }

  [[nodiscard]] std::vector<PlaceEvent> events() const override {
    std::lock_guard map_lock(map_mutex_);
    std::vector<PlaceEvent> events = keeper_.events();
    std::lock_guard lock(state_mutex_);
    events.insert(events.end(), found_events_.begin(), found_events_.end());
    std::stable_sort(events.begin(), events.end(),
                     [](const PlaceEvent& a, const PlaceEvent& b) { return a.frame_index < b.frame_index; });
    return events;
  }

  void read(const std::function<void(const Map&, const std::vector<MappingRecord>&)>& fn) const override {
    std::lock_guard lock(map_mutex_);
    fn(keeper_.map(), records_);
  }

 private:
  /// A local map is wanted: around the place a lost frame shows, or around a keyframe.
  struct PlaceRequest {
    std::shared_ptr<const TrackedFrame> lost;  // null = around the keyframe
    KeyframeId keyframe;
  };

  void wait_for_mapper() {
    std::unique_lock lock(state_mutex_);
    done_.wait(lock, [&] { return pending_ == 0; });
    if (failure_) std::rethrow_exception(failure_);
  }

  void answer(PlaceRequest& request) {
    std::lock_guard map_lock(map_mutex_);
    if (!request.lost) return publish(keeper_.around(request.keyframe));
    std::optional<FoundPlace> found = keeper_.find_place(*request.lost);
    std::lock_guard lock(state_mutex_);
    found_ = std::move(found);
  }

  // Global bundle adjustment, on a copy of the map.
  void settle(GlobalBundle& bundle) {
    bundle.solve(&abort_global_);
    std::lock_guard map_lock(map_mutex_);
    apply(bundle);
  }

  // Both with map_mutex_ held.
  void apply(const GlobalBundle& bundle) {
    keeper_.apply(bundle);
    publish(keeper_.around(local_map()->centre));
  }
  void start_global_bundle() {
    if (!keeper_.wants_global_bundle()) return;
    // Of the map as it was before the loop was closed nothing is of use any more.
    abort_global_ = !bundle_worker_.idle();
    if (!abort_global_) bundle_worker_.start(keeper_.begin_global_bundle());
  }

  void publish(std::shared_ptr<const LocalMap> local_map) {
    std::lock_guard lock(state_mutex_);
    if (local_map) local_map_ = std::move(local_map);
  }

  void find_lines() {
    while (auto keyframe = line_queue_.pop()) {
      if (over()) {
        done_with_one();
        continue;
      }
      std::vector<RegionLines> told;
      try {
        if (lines_) told = lines_->process(*keyframe);
      } catch (...) {
        fail(std::current_exception());
        done_with_one();
        continue;
      }
      {
        std::lock_guard lock(state_mutex_);
        if (!told.empty()) region_lines_ = std::move(told);
        ++with_lines_;
        abort_bundle_ = stopping_ || with_lines_ > 1;
      }
      mapper_queue_.push(std::move(*keyframe));
    }
  }

  void map_keyframes() {
    while (auto keyframe = mapper_queue_.pop()) {
      if (!over()) map_keyframe(*keyframe);
      {
        std::lock_guard lock(state_mutex_);
        --with_lines_;
        abort_bundle_ = stopping_ || with_lines_ > 1;
      }
      done_with_one();
    }
  }

  void map_keyframe(const NewKeyframe& keyframe) {
    try {
      std::lock_guard map_lock(map_mutex_);
      const Stopwatch stopwatch;
      auto local_map = keeper_.add(keyframe.candidate, &abort_bundle_);
      records_.push_back({keyframe.candidate.tracked.frame->index, keyframe.line_milliseconds,
                          stopwatch.milliseconds(), keeper_.removed()});
      publish(std::move(local_map));
      start_global_bundle();
    } catch (...) {
      fail(std::current_exception());
    }
  }

  // After a failure keyframes are only counted off: the mapper would give them the numbers of those before.
  // So they are when all is to end.
  void fail(std::exception_ptr failure) {
    std::lock_guard lock(state_mutex_);
    if (!failure_) failure_ = std::move(failure);
  }
  [[nodiscard]] bool over() const {
    std::lock_guard lock(state_mutex_);
    return stopping_ || failure_ != nullptr;
  }
  void done_with_one() {
    std::lock_guard lock(state_mutex_);
    --pending_;
    done_.notify_all();
  }

  MapKeeper keeper_;                    // guarded by map_mutex_
  std::vector<MappingRecord> records_;  // guarded by map_mutex_
  mutable std::mutex map_mutex_;
  std::optional<KeyframeLines> lines_;  // used by the line thread alone

  // Guarded by state_mutex_, down to failure_.
  std::shared_ptr<const LocalMap> local_map_;
  std::optional<FoundPlace> found_;  // the answer to the last search, until it is fetched
  std::vector<PlaceEvent> found_events_;
  std::vector<RegionLines> region_lines_;
  std::size_t pending_ = 0;     // submitted, not in the map yet
  std::size_t with_lines_ = 0;  // of these, those that the mapper works on or could work on
  bool stopping_ = false;
  std::exception_ptr failure_;
  mutable std::mutex state_mutex_;
  std::condition_variable done_;

  std::atomic<bool> abort_bundle_ = false, abort_global_ = false;
  std::size_t queue_size_;
  BoundedQueue<NewKeyframe> line_queue_;
  BoundedQueue<NewKeyframe> mapper_queue_;
  Worker<PlaceRequest> place_worker_;
  Worker<GlobalBundle> bundle_worker_;
  std::thread line_thread_, mapper_thread_;  // last: they start when everything else is there
};

}  // namespace

std::unique_ptr<MappingSchedule> make_realtime_mapping(MapKeeper keeper, std::optional<KeyframeLines> lines,
                                                       std::size_t queue_size) {
  return std::make_unique<RealtimeMapping>(std::move(keeper), std::move(lines), queue_size);
}

}  // namespace ipl_slam
