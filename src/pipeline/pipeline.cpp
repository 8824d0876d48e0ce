#include "pipeline/pipeline.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "common/stopwatch.hpp"

namespace ipl_slam {
namespace {

ScalePyramid pyramid_of(const Config& config) {
  return {config.orb.levels, config.orb.scale_factor};
}

std::unique_ptr<MappingSchedule> make_mapping(const Camera& camera, const Config& config) {
  LocalMapper mapper(camera, pyramid_of(config), config.depth, config.mapping);
  return config.schedule.mode == "realtime"
             ? make_realtime_mapping(std::move(mapper),
                                     static_cast<std::size_t>(config.schedule.keyframe_queue))
             : make_lockstep_mapping(std::move(mapper));
}

}  // namespace

Pipeline::Pipeline(const Camera& camera, const Config& config)
    : camera_(camera),
      threads_(config.schedule.threads),
      extractor_(config.orb, camera, config.depth, &threads_),
      instances_(make_instance_schedule(camera, config)),
      tracker_(camera, pyramid_of(config), config.depth, config.tracking),
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

  Features features = extractor_.extract(image.color, image.depth);
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
  TrackedFrame tracked = tracker_.track(frame, map);
  result.times.tracking = stopwatch.restart();

  if (!map && tracker_.can_start_map(*frame)) {
    start_map(tracked);
    result.keyframe = true;
  } else if (map && mapping_->has_room() && policy_.wants(tracked, *map, mapping_->idle())) {
    mapping_->submit({tracked, tracker_.take_sightings()});
    result.keyframe = true;
    // From here on its pose is the keyframe's own, which bundle adjustment goes on improving.
    tracked.reference = KeyframeId{keyframes_submitted_++};
    tracked.T_c_reference = SE3();
    tracker_.became_keyframe(tracked.reference);
  }

  const bool placed = tracked.state == TrackingState::kTracking;
  stopwatch.restart();
  instances_->placed(image, placed ? std::optional(tracked.T_cw.inverse()) : std::nullopt);
  result.times.instances += stopwatch.milliseconds();
  if (placed) {
    placed_.push_back({image.timestamp, tracked.reference, tracked.T_c_reference});
  }
  result.state = tracked.state;
  result.T_wc = tracked.T_cw.inverse();
  result.keypoints = frame->features.size();
  result.inliers = tracked.inliers;
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
    const Instance& instance = tracked.instance;
    records.push_back({tracked.id, instance.class_name, instance.score, instance.box, instance.mask.area(),
                       tracked.frames_carried, instances_->verdict(tracked.id)});
  }
  return records;
}

// The first keyframe stands at the world's origin.
void Pipeline::start_map(TrackedFrame& first) {
  mapping_->start({first, {}});
  first.state = TrackingState::kTracking;
  first.reference = KeyframeId{keyframes_submitted_++};
  tracker_.start(first);
  policy_.started_with(*first.frame);
}

Trajectory Pipeline::trajectory() const {
  Trajectory trajectory;
  mapping_->read([&](const Map& map, const std::vector<MappingTime>&) {
    for (const Placed& p : placed_) {
      trajectory.push_back({p.timestamp, (p.T_c_reference * map.pose_of(p.reference)).inverse()});
    }
  });
  return trajectory;
}

Trajectory Pipeline::keyframe_trajectory() const {
  Trajectory trajectory;
  mapping_->read([&](const Map& map, const std::vector<MappingTime>&) {
    map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
      trajectory.push_back({keyframe.frame->timestamp, keyframe.T_cw.inverse()});
    });
  });
  return trajectory;
}

}  // namespace ipl_slam
