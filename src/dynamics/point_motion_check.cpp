#include "dynamics/point_motion_check.hpp"

#include "common/random.hpp"
#include "geometry/reprojection.hpp"

namespace ipl_slam {

PointMotionCheck::PointMotionCheck(const Camera& camera, const ScalePyramid& pyramid,
                                   const PointMotionOptions& options, std::uint64_t seed)
    : camera_(camera), pyramid_(pyramid), options_(options), seed_(seed) {}

PointMotion PointMotionCheck::compare(const Frame& before, const Frame& now,
                                      const std::optional<SE3>& T_now_before,
                                      std::span<const std::uint8_t> witness) const {
  const std::size_t n = now.features.size();
  PointMotion motion{std::vector<std::uint8_t>(n, 0), std::vector<std::uint8_t>(n, 0),
                     std::vector<std::optional<double>>(n), std::vector<std::optional<double>>(n)};
  if (options_.check == "off") return motion;
  const std::vector<Pair> pairs = match(before, now, T_now_before.value_or(SE3()));
  if (T_now_before) measure_distances(before, now, pairs, *T_now_before, motion);
  if (options_.check == "epipolar") judge_by_epipolar_lines(before, now, pairs, witness, motion);
  if (options_.check == "depth" && T_now_before) judge_by_depth(before, now, pairs, *T_now_before, motion);
  return motion;
}

// Looks for every point of the earlier frame around where it would be if it were still. A point without depth
// is taken for far away: then only the camera's turn moves it.
std::vector<PointMotionCheck::Pair> PointMotionCheck::match(const Frame& before, const Frame& now,
                                                            const SE3& T_now_before) const {
  std::vector<ProjectedPoint> windows;
  std::vector<std::size_t> keypoints;
  for (std::size_t i = 0; i < before.features.size(); ++i) {
    const Keypoint& k = before.features.keypoints[i];
    const Eigen::Vector2d uv = k.undistorted.cast<double>();
    const Eigen::Vector3d p = k.depth > 0.0F ? T_now_before * camera_.unproject(uv, k.depth)
                                             : T_now_before.rotation() * camera_.unproject(uv, 1.0);
    if (p.z() < kMinProjectionDepth) continue;
    ProjectedPoint window{};
    window.uv = camera_.project(p).cast<float>();
    window.radius = static_cast<float>(options_.search_radius * pyramid_.scale(k.level));
    window.min_level = k.level - 1;
    window.max_level = k.level + 1;
    window.depth = k.depth > 0.0F ? static_cast<float>(p.z()) : 0.0F;
    window.descriptor = &before.features.descriptors[i];
    window.angle = k.angle;
    windows.push_back(window);
    keypoints.push_back(i);
  }
  const std::vector<int> found = match_projected(now.features, now.grid, windows, options_.match);
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] >= 0) pairs.push_back({keypoints[i], static_cast<std::size_t>(found[i])});
  }
  return pairs;
}

void PointMotionCheck::measure_distances(const Frame& before, const Frame& now, std::span<const Pair> pairs,
                                         const SE3& T_now_before, PointMotion& motion) const {
  for (const Pair& pair : pairs) {
    const Keypoint& a = before.features.keypoints[pair.before];
    const Keypoint& b = now.features.keypoints[pair.now];
    if (a.depth <= 0.0F || b.depth <= 0.0F) continue;
    const Eigen::Vector3d carried = T_now_before * camera_.unproject(a.undistorted.cast<double>(), a.depth);
    motion.distance[pair.now] = (carried - camera_.unproject(b.undistorted.cast<double>(), b.depth)).norm();
  }
}

void PointMotionCheck::judge_by_depth(const Frame& before, const Frame& now, std::span<const Pair> pairs,
                                      const SE3& T_now_before, PointMotion& motion) const {
  for (const Pair& pair : pairs) {
    const Keypoint& a = before.features.keypoints[pair.before];
    const Keypoint& b = now.features.keypoints[pair.now];
    if (a.depth <= 0.0F) continue;
    const Eigen::Vector3d carried = T_now_before * camera_.unproject(a.undistorted.cast<double>(), a.depth);
    if (carried.z() < kMinProjectionDepth) continue;
    const double sigma_pixel = options_.pixel_sigma * pyramid_.scale(std::max(a.level, b.level));
    double surprise =
        (camera_.project(carried) - b.undistorted.cast<double>()).squaredNorm() / (sigma_pixel * sigma_pixel);
    if (b.depth > 0.0F) {
      const double e = (1.0 / carried.z() - 1.0 / b.depth) / options_.inverse_depth_sigma;
      surprise += e * e;
    }
    motion.judged[pair.now] = 1;
    motion.surprise[pair.now] = surprise;
    motion.dynamic[pair.now] = surprise > options_.threshold ? 1 : 0;
  }
}

// Without an epipolar geometry (the camera stood, or only turned) nothing is judged.
void PointMotionCheck::judge_by_epipolar_lines(const Frame& before, const Frame& now,
                                               std::span<const Pair> pairs,
                                               std::span<const std::uint8_t> witness,
                                               PointMotion& motion) const {
  const auto pixels = [&](const Pair& pair) {
    return PixelPair{before.features.keypoints[pair.before].undistorted.cast<double>(),
                     now.features.keypoints[pair.now].undistorted.cast<double>()};
  };
  std::vector<PixelPair> still;
  for (const Pair& pair : pairs) {
    if (witness[pair.now]) still.push_back(pixels(pair));
  }
  const auto F = fundamental_matrix(still, options_.epipolar, hash64(seed_, now.index));
  if (!F) return;
  for (const Pair& pair : pairs) {
    motion.judged[pair.now] = 1;
    motion.dynamic[pair.now] = epipolar_distance(*F, pixels(pair)) > options_.epipolar.threshold ? 1 : 0;
  }
}

}  // namespace ipl_slam
