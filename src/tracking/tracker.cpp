#include "tracking/tracker.hpp"

#include <algorithm>
#include <utility>

namespace ipl_slam {
Tracker::Tracker(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                 const TrackerOptions& options, const SegmentDepthOptions& line_depth, std::uint64_t seed)
    : camera_(camera),
      pyramid_(pyramid),
      options_(options),
      optimizer_(camera, noise, options.pose),
      visibility_(camera, pyramid),
      line_visibility_(camera),
      line_tracker_(camera, options.lines, noise, line_depth, seed),
      relocalizer_(camera, pyramid, options.relocalizer, seed) {}

std::optional<SE3> Tracker::first_pose(const Frame& frame, std::shared_ptr<const LocalMap> map,
                                       std::span<const std::uint8_t> witness) {
  if (!map || lost()) return std::nullopt;
  adopt(std::move(map));
  if (!last_is_here_) return std::nullopt;
  const FeatureWeights all;
  View view{frame, {}, {}, all, {}};
  for (const std::uint8_t w : witness) view.removed.push_back(w ? 0 : 1);
  const Placement placement = match_widening(view, motion_.predict(frame.timestamp));
  if (placement.inliers < options_.min_prediction_inliers) return std::nullopt;
  return placement.T_cw;
}

TrackedFrame Tracker::track(std::shared_ptr<const Frame> frame, std::shared_ptr<const LocalMap> map,
                            const cv::Mat& grey, const cv::Mat& depth, FeatureWeights weights) {
  if (!map) {
    TrackedFrame waiting;
    waiting.points.resize(frame->features.size());
    waiting.frame = std::move(frame);
    waiting.weights = std::move(weights);
    return waiting;
  }
  adopt(std::move(map));

  const View view{*frame, grey, depth, weights, removed_features(weights.points, frame->features.size())};
  Placement placement;
  if (last_is_here_) {
    placement = place_by_prediction(view);
    if (support(placement) < options_.confident_inliers) {
      // Of a lost camera, too: no keyframe is nearer to where it was.
      keep_better(placement, place_from(view, *last_.frame, last_.T_cw));
    }
  }
  if (!believed(placement) && map_->found && (lost() || !last_is_here_))
    keep_better(placement, place_at(view, *map_->found));
  if (!believed(placement)) keep_better(placement, relocalize(view));
  return conclude(std::move(frame), placement, std::move(weights));
}

// Takes over a new local map: the last pose and velocity follow its corrections.
void Tracker::adopt(std::shared_ptr<const LocalMap> map) {
  if (map == map_) return;
  const bool corrected = map_ && map->corrections != map_->corrections;
  if (const std::optional<SE3> T_cw = carried_over(*map)) {
    if (corrected) T_ow_ = T_ow_ * last_.T_cw.inverse() * *T_cw;
    last_.T_cw = *T_cw;
    motion_.rebase(*T_cw);
    last_is_here_ = true;
  } else {
    last_is_here_ = last_is_here_ && map_ && map->part == map_->part && !corrected;
  }
  map_ = std::move(map);
  points_seen_.start(map_->points);
  lines_seen_.start(map_->lines);
}

// The last pose in the world of another local map: it moves with its reference keyframe, or, where that is
// not in the map yet, with the newest keyframe that both maps know.
std::optional<SE3> Tracker::carried_over(const LocalMap& to) const {
  if (const LocalKeyframe* reference = to.find_keyframe(last_.reference)) {
    return last_.T_c_reference * reference->T_cw;
  }
  if (!map_ || !last_is_here_) return std::nullopt;
  for (auto before = map_->keyframes.rbegin(); before != map_->keyframes.rend(); ++before) {
    if (const LocalKeyframe* now = to.find_keyframe(before->id)) {
      return last_.T_cw * before->T_cw.inverse() * now->T_cw;
    }
  }
  return std::nullopt;
}

// Windows widen until enough of the last frame's points agree on a motion.
Tracker::Placement Tracker::match_widening(const View& view, const SE3& T_cw) const {
  Placement best;
  for (const double widening : {1.0, 2.0, 4.0}) {
    Placement placement = match_last_frame(view, T_cw, widening * options_.prediction_radius);
    if (placement.inliers > best.inliers) best = std::move(placement);
    if (best.inliers >= options_.confident_inliers) break;
  }
  return best;
}

// Where points are rare lines have a say, too; a lost camera may not have moved far.
Tracker::Placement Tracker::place_by_prediction(const View& view) const {
  if (lost()) return place_by_lines(view, last_.T_cw);
  const SE3 T_cw = motion_.predict(view.frame.timestamp);
  Placement best = match_widening(view, T_cw);
  const bool by_points = best.inliers >= options_.min_prediction_inliers;
  best = by_points ? place_in_local_map(view, best, options_.local_radius) : Placement{};
  if (support(best) < options_.confident_inliers) keep_better(best, place_by_lines(view, T_cw));
  return best;
}

// Places the frame by lines alone, found from where the camera is expected, before points are looked for.
Tracker::Placement Tracker::place_by_lines(const View& view, const SE3& T_cw) const {
  LineSights sights = look_for_lines(view, T_cw, options_.lines.wide_radius);
  line_tracker_.measure_depth(view.depth, sights);
  const PoseEstimate estimate = optimizer_.optimize(T_cw, {}, line_tracker_.matches(sights, *map_));
  if (estimate.line_inliers == 0) return {};
  Placement start{.T_cw = estimate.T_cw};
  start.points.assign(view.frame.features.size(), -1);
  return place_in_local_map(view, start, options_.local_radius);
}

// From a pose that is rough, resting on the measured depth of few points: the first look around each landmark
// is a wide one.
Tracker::Placement Tracker::place_at(const View& view, const SE3& T_cw) const {
  Placement placement{.T_cw = T_cw};
  for (const double radius : {options_.prediction_radius, options_.local_radius}) {
    placement.points.assign(view.frame.features.size(), -1);
    placement = place_in_local_map(view, placement, radius);
  }
  return placement;
}

// Without a prediction: from what an earlier frame shows, wherever in the image it is now.
Tracker::Placement Tracker::place_from(const View& view, const Frame& earlier, const SE3& T_earlier_w) const {
  const std::optional<SE3> T_cw = relocalizer_.find_pose(view.frame, earlier, T_earlier_w, view.removed);
  return T_cw ? place_at(view, *T_cw) : Placement{};
}

// Compares the frame with keyframes, the nearest first. While the camera stays lost every frame goes on where
// the one before gave up, so that in time all of the local map is tried.
Tracker::Placement Tracker::relocalize(const View& view) const {
  const LocalKeyframe& centre = *map_->find_keyframe(map_->centre);
  const Eigen::Vector3d position =
      last_is_here_ ? last_.T_cw.inverse().translation() : centre.T_cw.inverse().translation();
  std::vector<std::pair<double, const LocalKeyframe*>> order;
  for (const LocalKeyframe& keyframe : map_->keyframes) {
    order.emplace_back((keyframe.T_cw.inverse().translation() - position).norm(), &keyframe);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });

  const auto tries = static_cast<std::size_t>(options_.relocalization_keyframes);
  Placement best;
  for (std::size_t i = 0; i < std::min(tries, order.size()) && !believed(best); ++i) {
    const LocalKeyframe& keyframe = *order[(frames_lost_ * tries + i) % order.size()].second;
    keep_better(best, place_from(view, *keyframe.frame, keyframe.T_cw));
  }
  return best;
}

void Tracker::keep_better(Placement& best, Placement other) const {
  if (support(other) > support(best)) best = std::move(other);
}

// Looks for the last frame's points around where the predicted pose puts them. Points without a landmark
// serve too, placed by their own depth: they carry the pose where the map is still thin.
Tracker::Placement Tracker::match_last_frame(const View& view, const SE3& T_cw, double radius) const {
  const Frame& frame = view.frame;
  const Features& last = last_.frame->features;
  const SE3 T_wl = last_.T_cw.inverse();
  std::vector<ProjectedPoint> windows;
  std::vector<Eigen::Vector3d> positions;
  std::vector<int> landmarks;
  for (std::size_t i = 0; i < last.size(); ++i) {
    const Keypoint& keypoint = last.keypoints[i];
    const int landmark = last_.points[i].valid() ? map_->find_point(last_.points[i]) : -1;
    if (landmark < 0 && (keypoint.depth <= 0.0F || last_.weights.point(i) <= 0.0)) continue;
    const Eigen::Vector3d position =
        landmark >= 0 ? map_->points[landmark].position
                      : T_wl * camera_.unproject(keypoint.undistorted.cast<double>(), keypoint.depth);
    const Eigen::Vector3d p_c = T_cw * position;
    if (p_c.z() <= 0.0) continue;
    const Eigen::Vector2d uv = camera_.project(p_c);
    if (!visibility_.inside(uv)) continue;
    ProjectedPoint window{};
    window.uv = uv.cast<float>();
    window.radius = static_cast<float>(radius * pyramid_.scale(keypoint.level));
    window.min_level = keypoint.level - 1;
    window.max_level = keypoint.level + 1;
    window.depth = static_cast<float>(p_c.z());
    window.descriptor = &last.descriptors[i];
    window.angle = keypoint.angle;
    windows.push_back(window);
    positions.push_back(position);
    landmarks.push_back(landmark);
  }

  const std::vector<int> found =
      match_projected(frame.features, frame.grid, windows, options_.last_frame_match, view.removed);
  std::vector<PointMatch> matches;
  std::vector<std::pair<int, int>> owners;  // keypoint, landmark
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < 0) continue;
    matches.push_back(point_match(positions[i], frame.features.keypoints[found[i]], pyramid_,
                                  view.weights.point(static_cast<std::size_t>(found[i]))));
    owners.emplace_back(found[i], landmarks[i]);
  }
  const PoseEstimate estimate = optimizer_.optimize(T_cw, matches);
  Placement placement{.T_cw = estimate.T_cw,
                      .points = std::vector<int>(frame.features.size(), -1),
                      .inliers = estimate.inliers};
  for (std::size_t i = 0; i < owners.size(); ++i) {
    if (estimate.inlier[i]) placement.points[owners[i].first] = owners[i].second;
  }
  return placement;
}

// Searches the whole local map from a pose that is nearly right, and settles the pose with all that is found.
Tracker::Placement Tracker::place_in_local_map(const View& view, const Placement& start,
                                               double radius) const {
  const Frame& frame = view.frame;
  std::vector<std::uint8_t> taken = view.removed;
  std::vector<std::uint8_t> matched(map_->points.size(), 0);
  for (std::size_t k = 0; k < start.points.size(); ++k) {
    if (start.points[k] < 0) continue;
    taken[k] = 1;
    matched[start.points[k]] = 1;
  }

  std::vector<ProjectedPoint> windows;
  std::vector<int> landmarks;
  for (std::size_t i = 0; i < map_->points.size(); ++i) {
    if (matched[i]) continue;
    if (const auto window = visibility_.project(start.T_cw, map_->points[i], radius);
        window && !hidden(view, window->uv.cast<double>())) {
      windows.push_back(*window);
      landmarks.push_back(static_cast<int>(i));
    }
  }
  const std::vector<int> found =
      match_projected(frame.features, frame.grid, windows, options_.local_map_match, taken);

  std::vector<int> points = start.points;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] >= 0) points[found[i]] = landmarks[i];
  }
  std::vector<PointMatch> matches;
  std::vector<std::size_t> keypoints;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (points[k] < 0) continue;
    matches.push_back(point_match(map_->points[points[k]].position, frame.features.keypoints[k], pyramid_,
                                  view.weights.point(k)));
    keypoints.push_back(k);
  }
  LineSights sights = look_for_lines(view, start.T_cw, options_.lines.radius);
  // The image of lines leaves the direction of view nearly open. Points close it; where they are rare the
  // lines' own depth must.
  if (static_cast<int>(matches.size()) < options_.confident_inliers) {
    line_tracker_.measure_depth(view.depth, sights);
  }
  const PoseEstimate estimate =
      optimizer_.optimize(start.T_cw, matches, line_tracker_.matches(sights, *map_));

  Placement placement{.T_cw = estimate.T_cw,
                      .points = std::move(points),
                      .visible = std::move(landmarks),
                      .inliers = estimate.inliers,
                      .deviation = largest_deviation(estimate.information),
                      .visible_lines = std::move(sights.visible)};
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    int& landmark = placement.points[keypoints[i]];
    if (matched[landmark]) placement.visible.push_back(landmark);
    if (!estimate.inlier[i]) landmark = -1;
  }
  for (std::size_t i = 0; i < sights.found.size(); ++i) {
    if (estimate.line_inlier[i]) placement.lines.push_back(sights.found[i]);
  }
  return placement;
}

// Whether something dynamic stands before what should be seen at an undistorted pixel.
bool Tracker::hidden(const View& view, const Eigen::Vector2d& uv) const {
  return !view.weights.dynamic.size().empty() && view.weights.in_dynamic(camera_.distort(uv));
}

// The same of a line from start to end.
bool Tracker::hidden(const View& view, const Eigen::Vector2d& start, const Eigen::Vector2d& end) const {
  return !view.weights.dynamic.size().empty() &&
         view.weights.dynamic_share(camera_.distort(start), camera_.distort(end)) >
             options_.max_dynamic_share;
}

// The lines of the local map that show outside dynamic regions. One that is partly hidden may still be found
// by the rest of it; where it is not, it was not to be expected.
LineSights Tracker::look_for_lines(const View& view, const SE3& T_cw, double radius) const {
  LineSights sights = line_tracker_.look(view.grey, T_cw, *map_, radius);
  std::erase_if(sights.found,
                [&](const LineSight& sight) { return hidden(view, sight.at.start, sight.at.end); });
  std::erase_if(sights.visible, [&](int index) {
    const LocalLine& line = map_->lines[static_cast<std::size_t>(index)];
    const auto part = line_visibility_.visible_part(T_cw, line.start, line.end);
    return part && hidden(view, part->first, part->second) &&
           std::none_of(sights.found.begin(), sights.found.end(),
                        [&](const LineSight& sight) { return sight.line == index; });
  });
  return sights;
}

void Tracker::count_sightings(const Placement& placement) {
  for (const int landmark : placement.visible) points_seen_.visible(landmark);
  for (const int landmark : placement.points) {
    if (landmark >= 0) points_seen_.found(landmark);
  }
  for (const int line : placement.visible_lines) lines_seen_.visible(line);
  for (const LineSight& sight : placement.lines) lines_seen_.found(sight.line);
}

double Tracker::support(const Placement& placement) const {
  if (placement.deviation > options_.max_deviation) return placement.inliers;
  return placement.inliers + options_.line_support * static_cast<double>(placement.lines.size());
}

bool Tracker::believed(const Placement& placement) const {
  return support(placement) >=
         (lost() || !last_is_here_ ? options_.min_inliers_recovering : options_.min_inliers);
}

TrackedFrame Tracker::conclude(std::shared_ptr<const Frame> frame, const Placement& placement,
                               FeatureWeights weights) {
  TrackedFrame result;
  result.weights = std::move(weights);
  result.inliers = placement.inliers;
  if (!believed(placement)) {
    if (!lost()) lost_since_ = frame->timestamp;
    ++frames_lost_;
    motion_.stop();
    result.state = TrackingState::kLost;
    result.T_cw = last_.T_cw;
    result.reference = last_.reference;
    result.T_c_reference = last_.T_c_reference;
    result.points.resize(frame->features.size());
    result.frame = std::move(frame);
    return result;
  }
  if (!last_is_here_) motion_.stop();
  frames_lost_ = 0;
  last_is_here_ = true;
  count_sightings(placement);
  motion_.update(frame->timestamp, placement.T_cw);
  const LocalKeyframe& reference = most_shared_keyframe(placement);
  result.state = TrackingState::kTracking;
  result.T_cw = placement.T_cw;
  result.reference = reference.id;
  result.T_c_reference = placement.T_cw * reference.T_cw.inverse();
  result.points.resize(frame->features.size());
  for (std::size_t k = 0; k < placement.points.size(); ++k) {
    if (placement.points[k] >= 0) result.points[k] = map_->points[placement.points[k]].id;
  }
  for (const LineSight& sight : placement.lines) {
    const LocalLine& line = map_->lines[sight.line];
    result.lines.push_back({line.id, sight.at.start, sight.at.end, line.weight});
  }
  result.frame = std::move(frame);
  last_ = result;
  return result;
}

const LocalKeyframe& Tracker::most_shared_keyframe(const Placement& placement) const {
  std::vector<std::uint8_t> points(map_->points.size(), 0), lines(map_->lines.size(), 0);
  for (const int point : placement.points) {
    if (point >= 0) points[point] = 1;
  }
  for (const LineSight& sight : placement.lines) lines[sight.line] = 1;
  const LocalKeyframe* best = &map_->keyframes.back();
  int best_shared = -1;
  for (const LocalKeyframe& keyframe : map_->keyframes) {
    int shared = 0;
    for (const std::uint32_t point : keyframe.points) shared += points[point];
    for (const std::uint32_t line : keyframe.lines) shared += lines[line];
    if (shared >= best_shared) {  // among equals the newest
      best_shared = shared;
      best = &keyframe;
    }
  }
  return *best;
}

bool Tracker::can_start_map(const Frame& frame, const LineFeatures* lines,
                            const FeatureWeights& weights) const {
  double support = 0.0;
  const std::vector<Keypoint>& keypoints = frame.features.keypoints;
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    if (keypoints[k].depth > 0.0F && weights.point(k) > 0.0) support += 1.0;
  }
  if (lines) {
    support += options_.line_support *
               static_cast<double>(std::count_if(lines->segments.begin(), lines->segments.end(),
                                                 [](const LineSegment& s) { return s.depth.known(); }));
  }
  return support >= options_.min_initial_depths;
}

bool Tracker::given_up(double timestamp) const {
  return lost() && options_.new_part_after > 0.0 && timestamp - lost_since_ >= options_.new_part_after;
}

void Tracker::start(const TrackedFrame& first) {
  last_ = first;
  last_is_here_ = false;  // not in the local map there is, but in the next one
  frames_lost_ = 0;
  motion_.stop();
  motion_.update(first.frame->timestamp, first.T_cw);
}

std::optional<SE3> Tracker::expected_pose(double timestamp) const {
  if (!map_ || lost() || !last_is_here_) return std::nullopt;
  return motion_.predict(timestamp).inverse();
}

void Tracker::became_keyframe(KeyframeId id) {
  last_.reference = id;
  last_.T_c_reference = SE3();
}

}  // namespace ipl_slam
