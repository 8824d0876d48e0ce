#include "loop/place_verifier.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "common/random.hpp"
#include "loop/absolute_pose.hpp"

namespace ipl_slam {
namespace {

// Cells of the image over which inliers must spread: about square for the usual 4:3.
constexpr int kColumns = 4, kRows = 3;

void add_feature(const Features& from, std::size_t i, Features& to) {
  to.keypoints.push_back(from.keypoints[i]);
  to.descriptors.push_back(from.descriptors[i]);
}

}  // namespace

PlaceVerifier::PlaceVerifier(const Camera& camera, const ScalePyramid& pyramid,
                             const DepthNoiseOptions& noise, const PlaceVerifierOptions& options,
                             const PoseOptimizerOptions& pose, std::uint64_t seed)
    : camera_(camera),
      pyramid_(pyramid),
      options_(options),
      optimizer_(camera, noise, pose),
      visibility_(camera, pyramid),
      search_(camera, pyramid, noise, options.search, pose),
      seed_(seed) {}

std::optional<PlaceMatch> PlaceVerifier::verify(const Map& map, const PlaceView& view,
                                                KeyframeId candidate) const {
  const std::optional<SE3> T_cw = first_pose(map, view, candidate);
  if (!T_cw) return std::nullopt;

  const LandmarkGroup group = landmarks_around(map, candidate, options_.neighbours);
  Placement placement{.T_cw = *T_cw};
  for (const double radius : {options_.wide_radius, options_.narrow_radius}) {
    placement = search_.place(map, view, group, placement.T_cw, radius);
  }
  if (placement.inliers < options_.min_inliers || placement.deviation > options_.max_deviation)
    return std::nullopt;
  const double share = found_share(map, view, group, placement);
  const auto [cells, filled_cells] = count_cells(view, placement);
  if (share < options_.min_found_share || cells < options_.min_cells ||
      cells < options_.min_cell_share * filled_cells) {
    return std::nullopt;
  }
  return PlaceMatch{.keyframe = candidate,
                    .T_cw = placement.T_cw,
                    .points = std::move(placement.points),
                    .lines = std::move(placement.lines),
                    .inliers = placement.inliers,
                    .line_inliers = placement.line_inliers,
                    .found_share = share,
                    .cells = cells,
                    .deviation = placement.deviation};
}

bool PlaceVerifier::confirms(const Map& map, const PlaceView& further, const SE3& T_cw,
                             KeyframeId candidate) const {
  const LandmarkGroup group = landmarks_around(map, candidate, options_.neighbours);
  Placement placement{.T_cw = T_cw};
  for (const double radius : {options_.wide_radius, options_.narrow_radius}) {
    placement = search_.place(map, further, group, placement.T_cw, radius);
  }
  return placement.inliers >= options_.min_confirming_inliers &&
         found_share(map, further, group, placement) >= options_.min_found_share;
}

// From the descriptors of what the candidate itself sees: they are taken from nearly where the view is, if it
// is the same place.
std::optional<SE3> PlaceVerifier::first_pose(const Map& map, const PlaceView& view,
                                             KeyframeId candidate) const {
  const Keyframe& keyframe = map.keyframes()[candidate];
  Features there, here;
  std::vector<PointId> owners;
  for (std::size_t k = 0; k < keyframe.points.size(); ++k) {
    if (!keyframe.points[k].valid()) continue;
    add_feature(keyframe.frame->features, k, there);
    owners.push_back(keyframe.points[k]);
  }
  std::vector<double> weights;
  for (std::size_t k = 0; k < view.frame.features.size(); ++k) {
    if (view.trust.weight(k) <= 0.0) continue;
    add_feature(view.frame.features, k, here);
    weights.push_back(view.trust.weight(k));
  }

  std::vector<PointMatch> matches;
  for (const auto& [i, j] : match_brute_force(there, here, options_.match)) {
    matches.push_back(point_match(map.points()[owners[i]].position, here.keypoints[j], pyramid_, weights[j]));
  }
  const RansacOptions ransac{.threshold = options_.ransac_threshold,
                             .max_iterations = options_.ransac_iterations,
                             .min_inliers = options_.min_matches};
  Random random(seeded(hash64(view.frame.index, candidate.value), seed_));
  const auto rough = absolute_pose(camera_, matches, ransac, random);
  if (!rough) return std::nullopt;
  std::vector<PointMatch> agreeing;
  for (const std::uint32_t i : rough->inliers) agreeing.push_back(matches[i]);
  return optimizer_.optimize(rough->model, agreeing).T_cw;
}

// Found points over those to be expected. Expected is only what several keyframes saw, as others may be
// mistakes, and what nothing hides; and each only as often as frames found it that should have seen it.
double PlaceVerifier::found_share(const Map& map, const PlaceView& view, const LandmarkGroup& group,
                                  const Placement& placement) const {
  std::vector<PointId> seen = placement.points;
  std::sort(seen.begin(), seen.end());
  double expected = 0.0;
  int found = 0;
  for (const PointId id : group.points) {
    const Point& point = map.points()[id];
    if (static_cast<int>(point.observations.size()) < options_.min_observations) continue;
    const auto shown = visibility_.project(placement.T_cw, point, options_.narrow_radius);
    if (!shown) continue;
    const bool there = std::binary_search(seen.begin(), seen.end(), id);
    if (!there && hidden(view, *shown)) continue;
    expected += static_cast<double>(point.found) / point.visible;
    found += there ? 1 : 0;
  }
  return expected > 0.0 ? std::min(1.0, found / expected) : 0.0;
}

// Whether something stands before a point, as the keypoint nearest to it tells: it is much nearer to the
// camera, or was removed as dynamic.
bool PlaceVerifier::hidden(const PlaceView& view, const ProjectedPoint& point) const {
  const std::vector<Keypoint>& keypoints = view.frame.features.keypoints;
  float nearest = std::numeric_limits<float>::infinity();
  bool hides = false;
  view.frame.grid.for_each_in_radius(
      point.uv.x(), point.uv.y(), static_cast<float>(options_.hiding_distance), 0, pyramid_.levels() - 1,
      [&](int k) {
        const Keypoint& keypoint = keypoints[static_cast<std::size_t>(k)];
        const bool removed = view.trust.weight(static_cast<std::size_t>(k)) <= 0.0;
        const float distance = (keypoint.undistorted - point.uv).squaredNorm();
        if (distance >= nearest || (keypoint.depth <= 0.0F && !removed)) return;
        nearest = distance;
        hides = removed || 1.0 / keypoint.depth - 1.0 / point.depth > options_.hiding_gate;
      });
  return hides;
}

std::pair<int, int> PlaceVerifier::count_cells(const PlaceView& view, const Placement& placement) const {
  std::array<bool, kColumns * kRows> agreeing{}, filled{};
  const auto cell = [](float position, int size, int cells) {
    return std::clamp(static_cast<int>(position / static_cast<float>(size) * static_cast<float>(cells)), 0,
                      cells - 1);
  };
  for (std::size_t k = 0; k < placement.points.size(); ++k) {
    if (view.trust.weight(k) <= 0.0) continue;
    const Eigen::Vector2f& pixel = view.frame.features.keypoints[k].pixel;
    const auto at = static_cast<std::size_t>(cell(pixel.y(), camera_.height, kRows) * kColumns +
                                             cell(pixel.x(), camera_.width, kColumns));
    filled[at] = true;
    if (placement.points[k].valid()) agreeing[at] = true;
  }
  return {static_cast<int>(std::count(agreeing.begin(), agreeing.end(), true)),
          static_cast<int>(std::count(filled.begin(), filled.end(), true))};
}

}  // namespace ipl_slam
