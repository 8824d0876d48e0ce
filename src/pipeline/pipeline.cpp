#include "pipeline/pipeline.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "common/stopwatch.hpp"

namespace ipl_slam {
namespace {

ScalePyramid pyramid_of(const Config& config) {
  return {config.orb.levels, config.orb.scale_factor};
}

std::optional<LineExtractor> make_line_extractor(const Camera& camera, const Config& config) {
  const std::optional<LineMethod> method = line_method(config.features);
  if (!method) return std::nullopt;
  return LineExtractor(*method, config.lines, camera, config.depth, config.schedule.seed);
}

cv::Mat to_grey(const cv::Mat& color) {
  if (color.type() != CV_8UC3) return color;  // grey, or refused by the extractor
  cv::Mat grey;
  cv::cvtColor(color, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

std::unique_ptr<MappingSchedule> make_mapping(const Camera& camera, const Config& config) {
  MapKeeper keeper(Map(pyramid_of(config)),
                   LocalMapper(camera, pyramid_of(config), config.depth, config.mapping),
                   config.mapping.local_map);
  std::optional<KeyframeLines> lines;
  if (auto extractor = make_line_extractor(camera, config)) {
    lines.emplace(std::move(*extractor), LineMotionCheck(camera, config.dynamics.lines),
                  config.tracking.max_dynamic_share);
  }
  return config.schedule.mode == "realtime"
             ? make_realtime_mapping(std::move(keeper), std::move(lines),
                                     static_cast<std::size_t>(config.schedule.keyframe_queue))
             : make_lockstep_mapping(std::move(keeper), std::move(lines));
}

}  // namespace

Pipeline::Pipeline(const Camera& camera, const Config& config)
    : camera_(camera),
      threads_(config.schedule.threads),
      noise_(config.features.noise, config.schedule.seed),
      extractor_(config.orb, camera, config.depth, &threads_),
      first_lines_(make_line_extractor(camera, config)),
      instances_(make_instance_schedule(camera, config)),
      dynamics_(camera, pyramid_of(config), dynamics_options(config), config.schedule.seed),
      tracker_(camera, pyramid_of(config), config.depth, config.tracking, config.lines.depth,
               config.schedule.seed),
      policy_(config.keyframes),
      mapping_(make_mapping(camera, config)),
      last_timestamp_(-std::numeric_limits<double>::infinity()) {}

FrameResult Pipeline::process(const RgbdFrame& image) {
  if (!std::isfinite(image.timestamp) || image.timestamp <= last_timestamp_) {
    throw std::invalid_argument(fmt::format("frame at {:.6f} s does not come after the one at {:.6f} s",
                                            image.timestamp, last_timestamp_));
  }
  FrameResult result;
  Stopwatch stopwatch;

  const cv::Mat grey = noise_.add(to_grey(image.color), image.index);
  Features features = extractor_.extract(grey, image.depth, dynamics_.feature_factor());
  FeatureGrid grid(features);
  const auto frame = std::make_shared<const Frame>(
      Frame{image.index, image.timestamp, std::move(features), std::move(grid)});
  last_timestamp_ = image.timestamp;
  result.times.features = stopwatch.restart();

  FrameInstances seen = instances_->see(image, tracker_.expected_pose(image.timestamp));
  last_instances_ = std::move(seen.instances);
  result.mask_age = seen.mask_age;
  result.times.instances = stopwatch.restart();

  const std::shared_ptr<const LocalMap> map = mapping_->local_map();
  dynamics_.add_lines(mapping_->take_region_lines());
  const std::vector<std::uint8_t>& witness = dynamics_.locate(frame, last_instances_);
  FeatureWeights weights = dynamics_.decide(tracker_.first_pose(*frame, map, witness),
                                            [&](InstanceId id) { return instances_->verdict(id).state; });
  result.times.dynamics = stopwatch.restart();

  TrackedFrame tracked =
      tracker_.track(frame, map, first_lines_ ? grey : cv::Mat(), image.depth, std::move(weights));
  result.times.tracking = stopwatch.restart();

  if (!map) {
    result.keyframe = start_map(tracked, grey, image.depth, result.times);
  } else if (mapping_->has_room() && policy_.wants(tracked, *map, mapping_->idle())) {
    mapping_->submit(
        {{tracked, tracker_.take_sightings(), tracker_.take_line_sightings()}, grey, image.depth});
    result.keyframe = true;
    // From here on its pose is the keyframe's own, which bundle adjustment goes on improving.
    tracked.reference = KeyframeId{keyframes_submitted_++};
    tracked.T_c_reference = SE3();
    tracker_.became_keyframe(tracked.reference);
  }

  const bool placed = tracked.state == TrackingState::kTracking;
  stopwatch.restart();
  instances_->placed(image, placed ? std::optional(tracked.T_cw.inverse()) : std::nullopt);
  dynamics_.placed(placed ? std::optional(tracked.T_cw) : std::nullopt);
  result.times.instances += stopwatch.milliseconds();
  if (placed) {
    placed_.push_back({image.timestamp, tracked.reference, tracked.T_c_reference});
  }
  result.state = tracked.state;
  result.T_wc = tracked.T_cw.inverse();
  result.keypoints = frame->features.size();
  result.inliers = tracked.inliers;
  result.lines = static_cast<int>(tracked.lines.size());
  last_tracked_ = std::move(tracked);
  result.instances = instance_records();
  return result;
}

void Pipeline::finish() {
  instances_->finish();
  mapping_->finish();
}

std::vector<InstanceRecord> Pipeline::instance_records() const {
  std::vector<InstanceRecord> records;
  for (const TrackedInstance& tracked : last_instances_) {
    records.push_back(record_of(tracked));
    records.back().verdict = instances_->verdict(tracked.id);
    for (const Region& region : *last_tracked_.weights.regions) {
      if (region.id == tracked.id) records.back().region = region.verdict;
    }
  }
  return records;
}

// The first keyframe stands at the world's origin. Until there is one each frame's lines are extracted.
bool Pipeline::start_map(TrackedFrame& first, const cv::Mat& grey, const cv::Mat& depth, FrameTimes& times) {
  NewKeyframe keyframe{.candidate = {.tracked = first}, .grey = grey, .depth = depth};
  if (first_lines_) {
    const Stopwatch stopwatch;
    keyframe.candidate.lines = std::make_shared<const LineFeatures>(first_lines_->extract(grey, depth));
    keyframe.line_milliseconds = stopwatch.milliseconds();
  }
  if (!tracker_.can_start_map(*first.frame, keyframe.candidate.lines.get())) {
    times.features += keyframe.line_milliseconds;
    return false;
  }
  mapping_->start(std::move(keyframe));
  first.state = TrackingState::kTracking;
  first.reference = KeyframeId{keyframes_submitted_++};
  tracker_.start(first);
  policy_.started_with(*first.frame);
  return true;
}

Trajectory Pipeline::trajectory() const {
  Trajectory trajectory;
  mapping_->read([&](const Map& map, const std::vector<MappingRecord>&) {
    for (const Placed& p : placed_) {
      trajectory.push_back({p.timestamp, (p.T_c_reference * map.pose_of(p.reference)).inverse()});
    }
  });
  return trajectory;
}

Trajectory Pipeline::keyframe_trajectory() const {
  Trajectory trajectory;
  mapping_->read([&](const Map& map, const std::vector<MappingRecord>&) {
    map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
      trajectory.push_back({keyframe.frame->timestamp, keyframe.T_cw.inverse()});
    });
  });
  return trajectory;
}

}  // namespace ipl_slam
