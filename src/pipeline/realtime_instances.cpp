#include "pipeline/realtime_instances.hpp"

#include <deque>
#include <mutex>
#include <utility>

#include "common/stopwatch.hpp"
#include "common/worker.hpp"
#include "segmentation/instance_tracker.hpp"

namespace ipl_slam {
namespace {

// Frames that masks can be carried through one after the other; where segmentation takes longer they take a
// leap.
constexpr std::size_t kMostViews = 30;

/// The frames since the last one that was segmented, shared by tracking and segmentation.
class RecentViews {
 public:
  void add(CarryView view) {
    std::lock_guard lock(mutex_);
    views_.push_back(std::move(view));
    if (views_.size() > kMostViews) views_.pop_front();
  }
  /// Where a frame turned out to be.
  void place(std::size_t frame, const std::optional<SE3>& T_wc) {
    std::lock_guard lock(mutex_);
    for (CarryView& view : views_) {
      if (view.index == frame) view.T_wc = T_wc;
    }
  }
  void forget_before(std::size_t frame) {
    std::lock_guard lock(mutex_);
    while (!views_.empty() && views_.front().index < frame) views_.pop_front();
  }
  /// The view of a frame, or of the first one after it.
  [[nodiscard]] std::optional<CarryView> from(std::size_t frame) const {
    std::lock_guard lock(mutex_);
    for (const CarryView& view : views_) {
      if (view.index >= frame) return view;
    }
    return std::nullopt;
  }

 private:
  mutable std::mutex mutex_;
  std::deque<CarryView> views_;  // in order
};

/// A tracker that is brought from frame to frame.
struct Follower {
  InstanceTracker tracker;
  std::size_t frame = 0;  // the one it is at
  std::vector<TrackedInstance> instances;

  void catch_up(const RecentViews& views) {
    while (const auto next = views.from(frame + 1)) {
      instances = tracker.carry(*next);
      frame = next->index;
    }
  }
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
    views_.add(carrier_.view(frame, T_wc));
    if (segmentation_.idle()) segmentation_.start(frame);
    // Only the first masks are waited for: a map must not be started on people nobody knows of.
    if (!published()) segmentation_.wait();
    if (auto newest = published(); newest && newest != followed_) {
      follower_ = newest->ahead;
      followed_ = std::move(newest);
    }
    if (!follower_) return {};
    follower_->catch_up(views_);
    return {follower_->instances, static_cast<int>(frame.index - followed_->frame.index)};
  }

  void placed(const RgbdFrame& frame, const std::optional<SE3>& T_wc) override {
    views_.place(frame.index, T_wc);
    if (!followed_ || followed_ == judged_ || !contours_.idle()) return;
    ContourFrame segmented = followed_->frame;
    if (const auto view = views_.from(segmented.index); view && view->index == segmented.index) {
      segmented.T_wc = view->T_wc;  // when it was segmented it may not have been tracked yet
    }
    contours_.start(std::move(segmented));
    judged_ = followed_;
  }

  [[nodiscard]] ContourVerdict verdict(InstanceId id) const override {
    std::lock_guard lock(mutex_);
    return verdicts_.of(id);
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
    ContourFrame frame;  // as it was segmented
    Follower ahead;      // the same instances in the newest frame there was when segmentation ended
  };

  // On the segmentation thread. By the time the segmenter is done the frame has been tracked, mostly.
  void segment(RgbdFrame& frame) {
    Stopwatch stopwatch;
    const std::vector<Instance> detections = segmenter_->segment(frame);
    times_.segmentation.push_back(stopwatch.restart());
    const std::optional<CarryView> kept = views_.from(frame.index);
    const CarryView view = kept && kept->index == frame.index ? *kept : carrier_.view(frame);
    std::vector<TrackedInstance> instances = tracker_.update(view, detections);
    views_.forget_before(frame.index);
    auto result = std::make_shared<Segmented>(
        Segmented{{frame.index, instances, frame.depth, view.T_wc}, {tracker_, frame.index, instances}});
    result->ahead.catch_up(views_);
    times_.tracks.push_back(stopwatch.restart());
    std::lock_guard lock(mutex_);
    published_ = std::move(result);
  }

  // On the thread of the contour window.
  void judge(const ContourFrame& frame) {
    const Stopwatch stopwatch;
    ContourVerdicts found = window_.process(frame);
    times_.contours.push_back(stopwatch.milliseconds());
    for (const DynamicSpan& span : found.dynamic) dynamic_.add(span);
    std::lock_guard lock(mutex_);
    verdicts_ = std::move(found);
  }

  [[nodiscard]] std::shared_ptr<const Segmented> published() const {
    std::lock_guard lock(mutex_);
    return published_;
  }

  MaskCarrier carrier_;
  RecentViews views_;
  std::optional<Follower> follower_;           // what tracking carries along
  std::shared_ptr<const Segmented> followed_;  // where it came from
  std::shared_ptr<const Segmented> judged_;

  std::unique_ptr<Segmenter> segmenter_;  // of the segmentation thread, as is tracker_
  InstanceTracker tracker_;               // at the frame that was segmented last
  ContourWindow window_;                  // of the contour thread, as is dynamic_
  DynamicSpans dynamic_;
  InstanceTimes times_;  // each field of the thread that does the work

  mutable std::mutex mutex_;
  std::shared_ptr<const Segmented> published_;  // guarded by mutex_, as is verdicts_
  ContourVerdicts verdicts_;

  Worker<RgbdFrame> segmentation_;  // last: they start when everything else is there
  Worker<ContourFrame> contours_;
};

}  // namespace

std::unique_ptr<InstanceSchedule> make_realtime_instances(std::unique_ptr<Segmenter> segmenter,
                                                          const Camera& camera, const Config& config) {
  return std::make_unique<RealtimeInstances>(std::move(segmenter), camera, config);
}

}  // namespace ipl_slam
