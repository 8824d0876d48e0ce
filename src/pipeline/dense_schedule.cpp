#include "pipeline/dense_schedule.hpp"

#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include <ipl_slam/error.hpp>

#include "common/bounded_queue.hpp"

namespace ipl_slam {
namespace {

void keep(const NewView& view, DenseMap& dense, DenseViews& views) {
  dense.add(view.id, view.frame.timestamp, view.frame.color, view.frame.depth, view.instances);
  views.add(view.id, view.kept);
}

class LockstepDense final : public DenseSchedule {
 public:
  LockstepDense(const Camera& camera, const Config& config) : dense_(camera, config.dense) {}

  void add(NewView view) override {
    if (failure_) return;
    try {
      keep(view, dense_, views_);
    } catch (const UserError&) {
      failure_ = std::current_exception();
    }
  }
  void finish() override {}
  void check() const override {
    if (failure_) std::rethrow_exception(failure_);
  }
  [[nodiscard]] DenseMap& dense() override { return dense_; }
  [[nodiscard]] const DenseMap& dense() const override { return dense_; }
  [[nodiscard]] const DenseViews& views() const override { return views_; }
  [[nodiscard]] std::size_t dropped() const override { return 0; }

 private:
  DenseMap dense_;
  DenseViews views_;
  std::exception_ptr failure_;
};

class RealtimeDense final : public DenseSchedule {
 public:
  RealtimeDense(const Camera& camera, const Config& config, ReadMap read_map)
      : options_(config.dense),
        read_map_(std::move(read_map)),
        dense_(camera, config.dense),
        queue_(kQueue),
        thread_([this] { work(); }) {}

  ~RealtimeDense() override {
    {
      std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    queue_.close();
    thread_.join();
  }

  void add(NewView view) override {
    {
      std::lock_guard lock(mutex_);
      if (failure_) return;
      if (pending_ == kQueue) {
        ++dropped_;
        return;
      }
      ++pending_;
    }
    queue_.push(std::move(view));
  }
  void finish() override {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return pending_ == 0; });
  }
  void check() const override {
    std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
  }
  [[nodiscard]] DenseMap& dense() override { return dense_; }
  [[nodiscard]] const DenseMap& dense() const override { return dense_; }
  [[nodiscard]] const DenseViews& views() const override { return views_; }
  [[nodiscard]] std::size_t dropped() const override {
    std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  // Keyframes come every few tenths of a second and take a few hundredths: more than this wait only where the
  // machine is far too slow.
  static constexpr std::size_t kQueue = 16;

  void work() {
    while (auto view = queue_.pop()) {
      std::exception_ptr failure;
      try {
        if (!over()) take(*view);
      } catch (...) {
        failure = std::current_exception();
      }
      std::lock_guard lock(mutex_);
      if (failure && !failure_) failure_ = failure;
      --pending_;
      done_.notify_all();
    }
  }

  [[nodiscard]] bool over() const {
    std::lock_guard lock(mutex_);
    return stopping_ || failure_ != nullptr;
  }

  void take(const NewView& view) {
    keep(view, dense_, views_);
    std::map<KeyframeId, ViewSituation> wanted;
    read_map_([&](const Map& map) { wanted = views_.in_part(map, views_.main_part(map), nullptr); });
    dense_.follow(wanted, options_.tolerance, static_cast<std::size_t>(options_.changes));
  }

  DenseOptions options_;
  ReadMap read_map_;
  DenseMap dense_;  // the thread's, until finish() has returned; so are the views
  DenseViews views_;
  mutable std::mutex mutex_;
  std::condition_variable done_;
  std::size_t pending_ = 0, dropped_ = 0;  // guarded by mutex_, as are the two below
  bool stopping_ = false;
  std::exception_ptr failure_;
  BoundedQueue<NewView> queue_;
  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace

std::unique_ptr<DenseSchedule> make_dense_schedule(const Camera& camera, const Config& config,
                                                   ReadMap read_map) {
  if (config.schedule.mode == "realtime") {
    return std::make_unique<RealtimeDense>(camera, config, std::move(read_map));
  }
  return std::make_unique<LockstepDense>(camera, config);
}

}  // namespace ipl_slam
