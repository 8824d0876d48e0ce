#include "pipeline/instance_schedule.hpp"

#include <utility>

#include "common/stopwatch.hpp"
#include "pipeline/realtime_instances.hpp"
#include "segmentation/instance_tracker.hpp"
#include "segmentation/make_segmenter.hpp"

namespace ipl_slam {
namespace {

class NoInstances final : public InstanceSchedule {
 public:
  [[nodiscard]] FrameInstances see(const RgbdFrame&, const std::optional<SE3>&) override { return {}; }
  void placed(const RgbdFrame&, const std::optional<SE3>&) override {}
  [[nodiscard]] ContourVerdict verdict(InstanceId id) const override { return ContourVerdicts().of(id); }
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
    const CarryView view = tracker_.view(frame, T_wc);
    seen_ = due ? tracker_.update(view, detections) : tracker_.carry(view);
    times_.tracks.push_back(stopwatch.restart());
    return {seen_, static_cast<int>(frame.index - *segmented_)};
  }

  void placed(const RgbdFrame& frame, const std::optional<SE3>& T_wc) override {
    const Stopwatch stopwatch;
    verdicts_ = window_.process({frame.index, std::move(seen_), frame.depth, T_wc});
    times_.contours.push_back(stopwatch.milliseconds());
    for (const DynamicSpan& span : verdicts_.dynamic) dynamic_.add(span);
  }

  [[nodiscard]] ContourVerdict verdict(InstanceId id) const override { return verdicts_.of(id); }
  void finish() override {}
  [[nodiscard]] const InstanceTimes& times() const override { return times_; }
  [[nodiscard]] const DynamicSpans& dynamic() const override { return dynamic_; }
  [[nodiscard]] std::vector<std::string> remarks() const override { return segmenter_->remarks(); }

 private:
  std::unique_ptr<Segmenter> segmenter_;
  std::size_t every_;
  InstanceTracker tracker_;
  ContourWindow window_;
  std::optional<std::size_t> segmented_;  // the frame that was segmented last
  std::vector<TrackedInstance> seen_;     // in the frame that was seen last
  ContourVerdicts verdicts_;
  InstanceTimes times_;
  DynamicSpans dynamic_;
};

}  // namespace

std::unique_ptr<InstanceSchedule> make_instance_schedule(const Camera& camera, const Config& config) {
  std::unique_ptr<Segmenter> segmenter = make_segmenter(config.segmentation, camera, config.schedule.seed);
  if (!segmenter) return std::make_unique<NoInstances>();
  if (config.schedule.mode == "realtime") {
    return make_realtime_instances(std::move(segmenter), camera, config);
  }
  return std::make_unique<LockstepInstances>(std::move(segmenter), camera, config);
}

}  // namespace ipl_slam
