#include "pipeline/pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "common/stopwatch.hpp"
#include "pipeline/map_export.hpp"
#include "pipeline/realtime_mapping.hpp"

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

std::unique_ptr<MappingSchedule> make_mapping(const Camera& camera, const Config& config,
                                              std::optional<Map> loaded) {
  MapKeeper keeper(camera, config, std::move(loaded));
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

Pipeline::Pipeline(const Camera& camera, const Config& config, std::optional<Map> loaded, bool localize_only)
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
      localize_only_(localize_only),
      first_made_{loaded ? static_cast<std::uint32_t>(loaded->keyframes().ids_used()) : 0},
      next_keyframe_(first_made_.value),
      last_timestamp_(-std::numeric_limits<double>::infinity()) {
  if (localize_only && next_keyframe_ == 0) {
    throw std::invalid_argument("there is no map to localize the camera in");
  }
  mapping_ = make_mapping(camera, config, std::move(loaded));
  if (config.dense.enabled && !localize_only) {
    const auto read_map = [mapping = mapping_.get()](const std::function<void(const Map&)>& fn) {
      mapping->read([&](const Map& map, const std::vector<MappingRecord>&) { fn(map); });
    };
    dense_ = make_dense_schedule(camera, config, read_map);
    if (config.schedule.mode == "realtime") dense_tolerance_ = config.dense.tolerance;
  }
}

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

  // What is judged over frames goes by poses in a world without jumps.
  const auto to_odometry = [&](const SE3& T_wc) { return tracker_.T_ow() * T_wc; };
  std::optional<SE3> expected = tracker_.expected_pose(image.timestamp);
  if (expected) expected = to_odometry(*expected);
  FrameInstances seen = instances_->see(image, expected);
  last_instances_ = std::move(seen.instances);
  result.mask_age = seen.mask_age;
  result.times.instances = stopwatch.restart();

  std::shared_ptr<const LocalMap> map = mapping_->local_map();
  dynamics_.add_lines(mapping_->take_region_lines());
  const std::vector<std::uint8_t>& witness = dynamics_.locate(frame, last_instances_);
  std::optional<SE3> first_pose = tracker_.first_pose(*frame, map, witness);
  if (first_pose) first_pose = to_odometry(first_pose->inverse()).inverse();
  FeatureWeights weights =
      dynamics_.decide(first_pose, [&](InstanceId id) { return instances_->verdict(id).state; });
  result.times.dynamics = stopwatch.restart();

  const cv::Mat line_image = first_lines_ ? grey : cv::Mat();
  TrackedFrame tracked = tracker_.track(frame, map, line_image, image.depth, std::move(weights));
  if (tracked.state == TrackingState::kLost)
    tracked = recover(std::move(tracked), map, line_image, image.depth);
  result.times.tracking = stopwatch.restart();

  if (!map || (tracker_.given_up(image.timestamp) && !localize_only_)) {
    result.keyframe = start_map(tracked, grey, image.depth, result.times);
  } else if (localize_only_) {
    if (tracked.state == TrackingState::kTracking && tracked.reference != map->centre) {
      mapping_->move_to(tracked.reference);
    }
    (void)tracker_.take_sightings();  // nobody counts them
    (void)tracker_.take_line_sightings();
  } else {
    result.keyframe = submit(tracked, *map, grey, image.depth);
  }
  if (result.keyframe && dense_) keep_view(image, tracked);

  stopwatch.restart();
  std::optional<SE3> T_oc;
  if (tracked.state == TrackingState::kTracking) {
    T_oc = to_odometry(tracked.T_cw.inverse());
    placed_.push_back({image.timestamp, tracked.reference, tracked.T_c_reference});
  }
  instances_->placed(image, T_oc);
  dynamics_.placed(T_oc ? std::optional(T_oc->inverse()) : std::nullopt);
  result.times.instances += stopwatch.milliseconds();
  result.state = tracked.state;
  result.T_wc = tracked.T_cw.inverse();
  result.keypoints = frame->features.size();
  result.inliers = tracked.inliers;
  result.lines = static_cast<int>(tracked.lines.size());
  last_tracked_ = std::move(tracked);
  result.instances = instance_records();
  return result;
}

TrackedFrame Pipeline::recover(TrackedFrame lost, std::shared_ptr<const LocalMap>& map, const cv::Mat& grey,
                               const cv::Mat& depth) {
  const std::optional<FoundPlace> place = mapping_->find_place(lost);
  if (!place) return lost;
  TrackedFrame again = tracker_.track(lost.frame, place->map, grey, depth, lost.weights);
  if (again.state != TrackingState::kTracking) return lost;
  mapping_->resume_at(*place);
  map = place->map;
  return again;
}

bool Pipeline::submit(TrackedFrame& tracked, const LocalMap& map, const cv::Mat& grey, const cv::Mat& depth) {
  if (!mapping_->has_room() || !policy_.wants(tracked, map, mapping_->idle())) return false;
  mapping_->submit({{tracked, tracker_.take_sightings(), tracker_.take_line_sightings()}, grey, depth});
  // From here on its pose is the keyframe's own, which bundle adjustment goes on improving.
  tracked.reference = KeyframeId{next_keyframe_++};
  tracked.T_c_reference = SE3();
  tracker_.became_keyframe(tracked.reference);
  return true;
}

void Pipeline::keep_view(const RgbdFrame& image, const TrackedFrame& tracked) {
  NewView view{.id = tracked.reference, .frame = image, .instances = last_instances_, .kept = {image.index}};
  for (const TrackedInstance& seen : last_instances_) {
    const bool has_class = seen.instance.class_name != "unknown";
    (has_class ? view.kept.classed : view.kept.unclassed).insert(seen.id);
  }
  for (const Region& region : *tracked.weights.regions) {
    if (region.verdict.dynamic) view.kept.dynamic.insert(region.id);
  }
  dense_->add(std::move(view));
}

void Pipeline::finish() {
  instances_->finish();
  mapping_->finish();
  if (dense_) dense_->finish();
}

DenseMap::Result Pipeline::fuse(const std::function<void()>& progress) {
  dense_->check();
  const PartId part = trajectory_parts().front().part;
  std::map<KeyframeId, ViewSituation> wanted;
  mapping_->read([&](const Map& map, const std::vector<MappingRecord>&) {
    wanted = dense_->views().in_part(map, part, &instances_->dynamic());
  });
  dense_->dense().follow(wanted, dense_tolerance_, wanted.size() + dense_->dense().size(), progress);
  return dense_->dense().cloud(progress);
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

// The first keyframe of a part stands at the origin of its world. Until there is one each frame's lines are
// extracted.
bool Pipeline::start_map(TrackedFrame& first, const cv::Mat& grey, const cv::Mat& depth, FrameTimes& times) {
  TrackedFrame origin;
  origin.frame = first.frame;
  origin.points.resize(first.points.size());
  origin.weights = first.weights;
  NewKeyframe keyframe{.candidate = {.tracked = origin}, .grey = grey, .depth = depth};
  if (first_lines_) {
    const Stopwatch stopwatch;
    keyframe.candidate.lines = std::make_shared<const LineFeatures>(first_lines_->extract(grey, depth));
    keyframe.line_milliseconds = stopwatch.milliseconds();
  }
  if (!tracker_.can_start_map(*origin.frame, keyframe.candidate.lines.get(), origin.weights)) {
    times.features += keyframe.line_milliseconds;
    return false;
  }
  mapping_->start(std::move(keyframe));
  first = std::move(origin);
  first.state = TrackingState::kTracking;
  first.reference = KeyframeId{next_keyframe_++};
  tracker_.start(first);
  policy_.started_with(*first.frame);
  return true;
}

std::vector<TrajectoryPart> Pipeline::trajectory_parts() const {
  TrajectoryParts lists;
  mapping_->read([&](const Map& map, const std::vector<MappingRecord>&) {
    for (const Placed& p : placed_) {
      lists.add(map.part_of(p.reference),
                {p.timestamp, (p.T_c_reference * map.pose_of(p.reference)).inverse()});
    }
  });
  return lists.longest_first();
}

std::vector<TrajectoryPart> Pipeline::keyframe_parts() const {
  std::vector<TrajectoryPart> parts;
  mapping_->read([&](const Map& map, const std::vector<MappingRecord>&) {
    parts = ipl_slam::keyframe_parts(map, first_made_);
  });
  const PartId main = trajectory_parts().front().part;
  const auto is_main = [&](const TrajectoryPart& p) { return p.part == main; };
  // Of a part that was loaded there may be frames, but no keyframe.
  if (std::none_of(parts.begin(), parts.end(), is_main)) parts.push_back({main, {}});
  std::stable_partition(parts.begin(), parts.end(), is_main);
  return parts;
}

}  // namespace ipl_slam
