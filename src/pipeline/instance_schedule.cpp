#include "pipeline/instance_schedule.hpp"

#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "common/bounded_queue.hpp"
#include "common/stopwatch.hpp"
#include "segmentation/instance_tracker.hpp"
#include "segmentation/make_segmenter.hpp"
#include "segmentation/mask_carrier.hpp"

namespace ipl_slam {
namespace {

// The verdicts of the frame that was judged last.
using Verdicts = std::map<InstanceId, ContourVerdict>;

Verdicts by_id(const std::vector<ContourVerdict>& verdicts) {
  Verdicts map;
  for (const ContourVerdict& v : verdicts) map.emplace(v.id, v);
  return map;
}

ContourVerdict find(const Verdicts& verdicts, InstanceId id) {
  const auto found = verdicts.find(id);
  return found == verdicts.end()
             ? ContourVerdict{.id = id, .state = MotionState::kCandidate, .similarity = std::nullopt}
             : found->second;
}

// The camera's motion T_to_from between two poses (camera to world), where both are known.
std::optional<SE3> motion_between(const std::optional<SE3>& T_w_from, const std::optional<SE3>& T_w_to) {
  if (!T_w_from || !T_w_to) return std::nullopt;
  return T_w_to->inverse() * *T_w_from;
}

class NoInstances final : public InstanceSchedule {
 public:
  [[nodiscard]] FrameInstances see(const RgbdFrame&, const std::optional<SE3>&) override { return {}; }
  void placed(const RgbdFrame&, const std::optional<SE3>&) override {}
  [[nodiscard]] ContourVerdict verdict(InstanceId id) const override { return find({}, id); }
  void finish() override {}
  [[nodiscard]] const InstanceTimes& times() const override { return times_; }
  [[nodiscard]] const DynamicSpans& dynamic() const override { return dynamic_; }
  [[nodiscard]] std::vector<std::string> remarks() const override { return {}; }

 private:
  InstanceTimes times_;
  DynamicSpans dynamic_;
};

class LockstepInstances final : public InstanceSchedule {
 public:
  LockstepInstances(std::unique_ptr<Segmenter> segmenter, const Camera& camera, const Config& config)
      : segmenter_(std::move(segmenter)),
        every_(static_cast<std::size_t>(config.segmentation.every)),
        tracker_(camera, config.instances, config.mask_carrier),
        window_(camera, config.contours) {}

  [[nodiscard]] FrameInstances see(const RgbdFrame& frame, const std::optional<SE3>& T_wc) override {
    Stopwatch stopwatch;
    const bool due = !segmented_ || frame.index >= *segmented_ + every_;
    std::vector<Instance> detections;
    if (due) {
      detections = segmenter_->segment(frame);
      times_.segmentation.push_back(stopwatch.restart());
      segmented_ = frame.index;
    }
    const CarryView view = tracker_.view(frame);
    const std::optional<SE3> T_now_last = motion_between(last_T_wc_, T_wc);
    const SE3* motion = T_now_last ? &*T_now_last : nullptr;
    seen_ = due ? tracker_.update(view, detections, motion) : tracker_.carry(view, motion);
    times_.tracks.push_back(stopwatch.restart());
    return {seen_, static_cast<int>(frame.index - *segmented_)};
  }

  void placed(const RgbdFrame& frame, const std::optional<SE3>& T_wc) override {
    const Stopwatch stopwatch;
    const ContourVerdicts found = window_.process({frame.index, std::move(seen_), frame.depth, T_wc});
    times_.contours.push_back(stopwatch.milliseconds());
    verdicts_ = by_id(found.verdicts);
    for (const DynamicSpan& span : found.dynamic) dynamic_.add(span);
    last_T_wc_ = T_wc;
  }

  [[nodiscard]] ContourVerdict verdict(InstanceId id) const override { return find(verdicts_, id); }
  void finish() override {}
  [[nodiscard]] const InstanceTimes& times() const override { return times_; }
  [[nodiscard]] const DynamicSpans& dynamic() const override { return dynamic_; }
  [[nodiscard]] std::vector<std::string> remarks() const override { return segmenter_->remarks(); }

 private:
  std::unique_ptr<Segmenter> segmenter_;
  std::size_t every_;
  InstanceTracker tracker_;
  ContourWindow window_;
  std::optional<SE3> last_T_wc_;          // of the frame before
  std::optional<std::size_t> segmented_;  // the frame that was segmented last
  std::vector<TrackedInstance> seen_;     // in the frame that was seen last
  Verdicts verdicts_;
  InstanceTimes times_;
  DynamicSpans dynamic_;
};

// A thread that works off one job at a time: a new one is taken only when the one before is done.
template <class Job>
class Worker {
 public:
  explicit Worker(std::function<void(Job&)> work) : work_(std::move(work)), thread_([this] { run(); }) {}
  ~Worker() {
    queue_.close();
    thread_.join();
  }

  /// Throws what the last job threw.
  [[nodiscard]] bool idle() const {
    std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    return !busy_;
  }
  /// Only while idle.
  void start(Job job) {
    {
      std::lock_guard lock(mutex_);
      busy_ = true;
    }
    queue_.push(std::move(job));
  }
  void wait() const {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return !busy_; });
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void run() {
    while (auto job = queue_.pop()) {
      std::exception_ptr failure;
      try {
        work_(*job);
      } catch (...) {
        failure = std::current_exception();
      }
      std::lock_guard lock(mutex_);
      if (failure) failure_ = failure;
      busy_ = false;
      done_.notify_all();
    }
  }

  std::function<void(Job&)> work_;
  mutable std::mutex mutex_;
  mutable std::condition_variable done_;
  bool busy_ = false;  // guarded by mutex_, as is failure_
  std::exception_ptr failure_;
  BoundedQueue<Job> queue_{1};
  std::thread thread_;  // last: starts when everything else is there
};

class RealtimeInstances final : public InstanceSchedule {
 public:
  RealtimeInstances(std::unique_ptr<Segmenter> segmenter, const Camera& camera, const Config& config)
      : carrier_(camera, config.mask_carrier),
        segmenter_(std::move(segmenter)),
        tracker_(camera, config.instances, config.mask_carrier),
        window_(camera, config.contours),
        segmentation_([this](RgbdFrame& frame) { segment(frame); }),
        contours_([this](ContourFrame& frame) { judge(frame); }) {}

  [[nodiscard]] FrameInstances see(const RgbdFrame& frame, const std::optional<SE3>& T_wc) override {
    if (segmentation_.idle()) segmentation_.start(frame);
    const std::shared_ptr<const Segmented> newest = published();
    if (!newest) return {};
    const std::optional<SE3> T_to_from = motion_between(pose_of(newest->frame.index), T_wc);
    return carried_to(frame, *newest, T_to_from ? &*T_to_from : nullptr);
  }

  void placed(const RgbdFrame& frame, const std::optional<SE3>& T_wc) override {
    {
      std::lock_guard lock(mutex_);
      poses_[frame.index] = T_wc;
    }
    const std::shared_ptr<const Segmented> newest = published();
    if (!newest || newest == judged_ || !contours_.idle()) return;
    const std::size_t index = newest->frame.index;
    contours_.start({index, newest->instances, newest->frame.depth, pose_of(index)});
    judged_ = newest;
    std::lock_guard lock(mutex_);
    poses_.erase(poses_.begin(), poses_.lower_bound(index));
  }

  [[nodiscard]] ContourVerdict verdict(InstanceId id) const override {
    std::lock_guard lock(mutex_);
    return find(verdicts_, id);
  }
  void finish() override {
    segmentation_.wait();
    contours_.wait();
  }
  [[nodiscard]] const InstanceTimes& times() const override { return times_; }
  [[nodiscard]] const DynamicSpans& dynamic() const override { return dynamic_; }
  [[nodiscard]] std::vector<std::string> remarks() const override { return segmenter_->remarks(); }

 private:
  struct Segmented {
    RgbdFrame frame;
    CarryView view;
    std::vector<TrackedInstance> instances;
  };

  // On the segmentation thread.
  void segment(RgbdFrame& frame) {
    Stopwatch stopwatch;
    const std::vector<Instance> detections = segmenter_->segment(frame);
    times_.segmentation.push_back(stopwatch.restart());
    // By now the frame has been tracked, mostly.
    const std::optional<SE3> T_wc = pose_of(frame.index);
    const std::optional<SE3> T_now_last = motion_between(last_T_wc_, T_wc);
    auto result = std::make_shared<Segmented>();
    result->view = carrier_.view(frame);
    result->instances = tracker_.update(result->view, detections, T_now_last ? &*T_now_last : nullptr);
    last_T_wc_ = T_wc;
    result->frame = std::move(frame);
    times_.tracks.push_back(stopwatch.restart());
    std::lock_guard lock(mutex_);
    published_ = std::move(result);
  }

  // On the thread of the contour window.
  void judge(const ContourFrame& frame) {
    const Stopwatch stopwatch;
    const ContourVerdicts found = window_.process(frame);
    times_.contours.push_back(stopwatch.milliseconds());
    for (const DynamicSpan& span : found.dynamic) dynamic_.add(span);
    std::lock_guard lock(mutex_);
    verdicts_ = by_id(found.verdicts);
  }

  [[nodiscard]] std::shared_ptr<const Segmented> published() const {
    std::lock_guard lock(mutex_);
    return published_;
  }
  [[nodiscard]] std::optional<SE3> pose_of(std::size_t frame) const {
    std::lock_guard lock(mutex_);
    const auto found = poses_.find(frame);
    return found == poses_.end() ? std::nullopt : found->second;
  }

  [[nodiscard]] FrameInstances carried_to(const RgbdFrame& frame, const Segmented& from,
                                          const SE3* T_to_from) const {
    std::vector<const BitMask*> masks;
    for (const TrackedInstance& t : from.instances) masks.push_back(&t.instance.mask);
    std::vector<CarriedMask> carried = carrier_.carry(from.view, masks, carrier_.view(frame), T_to_from);
    FrameInstances result;
    result.mask_age = static_cast<int>(frame.index - from.frame.index);
    for (std::size_t i = 0; i < carried.size(); ++i) {
      if (carried[i].mask.none()) continue;
      TrackedInstance instance = from.instances[i];
      instance.frames_carried += result.mask_age;
      instance.instance.mask = std::move(carried[i].mask);
      instance.instance.box = instance.instance.mask.bounding_box();
      result.instances.push_back(std::move(instance));
    }
    return result;
  }

  MaskCarrier carrier_;
  std::shared_ptr<const Segmented> judged_;

  std::unique_ptr<Segmenter> segmenter_;  // of the segmentation thread, as are the next two
  InstanceTracker tracker_;
  std::optional<SE3> last_T_wc_;  // of the frame segmented last
  ContourWindow window_;          // of the contour thread, as is dynamic_
  DynamicSpans dynamic_;
  InstanceTimes times_;  // each field of the thread that does the work

  mutable std::mutex mutex_;
  std::shared_ptr<const Segmented> published_;  // guarded by mutex_, as is verdicts_
  Verdicts verdicts_;
  std::map<std::size_t, std::optional<SE3>>
      poses_;  // likewise; of frames since the one judged last, by index

  Worker<RgbdFrame> segmentation_;  // last: they start when everything else is there
  Worker<ContourFrame> contours_;
};

}  // namespace

std::unique_ptr<InstanceSchedule> make_instance_schedule(const Camera& camera, const Config& config) {
  std::unique_ptr<Segmenter> segmenter = make_segmenter(config.segmentation, camera);
  if (!segmenter) return std::make_unique<NoInstances>();
  if (config.schedule.mode == "realtime") {
    return std::make_unique<RealtimeInstances>(std::move(segmenter), camera, config);
  }
  return std::make_unique<LockstepInstances>(std::move(segmenter), camera, config);
}

}  // namespace ipl_slam
