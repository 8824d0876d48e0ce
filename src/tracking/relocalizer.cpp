#include "tracking/relocalizer.hpp"

#include <algorithm>

#include "common/random.hpp"
#include "geometry/alignment.hpp"
#include "geometry/ransac.hpp"

namespace ipl_slam {
namespace {

// Rigid motion from three points measured in both frames, judged by where it puts the keyframe's points in
// the image: pixels are a fairer measure than metres, which a far point's depth alone can use up.
class MotionEstimator {
 public:
  using Model = SE3;  // T_ck: keyframe to frame
  static constexpr std::size_t kSampleSize = 3;

  explicit MotionEstimator(const Camera& camera) : camera_(camera) {}

  void add(const Keypoint& keyframe_keypoint, const Keypoint& frame_keypoint, double scale) {
    points_k_.push_back(
        camera_.unproject(keyframe_keypoint.undistorted.cast<double>(), keyframe_keypoint.depth));
    points_c_.push_back(camera_.unproject(frame_keypoint.undistorted.cast<double>(), frame_keypoint.depth));
    uv_.push_back(frame_keypoint.undistorted.cast<double>());
    inverse_scale2_.push_back(1.0 / (scale * scale));
  }

  [[nodiscard]] std::size_t size() const { return uv_.size(); }

  [[nodiscard]] std::optional<SE3> fit(std::span<const std::uint32_t> indices) const {
    std::vector<Eigen::Vector3d> from, to;
    for (const std::uint32_t i : indices) {
      from.push_back(points_k_[i]);
      to.push_back(points_c_[i]);
    }
    return align_rigid(from, to);
  }

  [[nodiscard]] double squared_error(const SE3& T_ck, std::uint32_t i) const {
    const Eigen::Vector3d p_c = T_ck * points_k_[i];
    if (p_c.z() <= 0.0) return std::numeric_limits<double>::infinity();
    return (uv_[i] - camera_.project(p_c)).squaredNorm() * inverse_scale2_[i];
  }

 private:
  const Camera& camera_;
  std::vector<Eigen::Vector3d> points_k_, points_c_;
  std::vector<Eigen::Vector2d> uv_;
  std::vector<double> inverse_scale2_;
};

}  // namespace

Relocalizer::Relocalizer(const Camera& camera, const ScalePyramid& pyramid, const RelocalizerOptions& options,
                         std::uint64_t seed)
    : camera_(camera), pyramid_(pyramid), options_(options), seed_(seed) {}

std::optional<SE3> Relocalizer::find_pose(const Frame& frame, const Frame& earlier, const SE3& T_earlier_w,
                                          std::span<const std::uint8_t> removed) const {
  const Features& there = earlier.features;
  MotionEstimator estimator(camera_);
  for (const auto& [i, j] : match_brute_force(there, frame.features, options_.match)) {
    if (!removed.empty() && removed[static_cast<std::size_t>(j)]) continue;
    const Keypoint& a = there.keypoints[i];
    const Keypoint& b = frame.features.keypoints[j];
    if (a.depth > 0.0F && b.depth > 0.0F) estimator.add(a, b, pyramid_.scale(b.level));
  }
  RansacOptions ransac_options;
  ransac_options.threshold = options_.ransac_threshold;
  ransac_options.max_iterations = options_.ransac_iterations;
  ransac_options.min_inliers = options_.min_matches;
  Random random(seeded(hash64(frame.index, earlier.index), seed_));
  const auto result = ransac(estimator, ransac_options, random);
  if (!result) return std::nullopt;
  return result->model * T_earlier_w;
}

}  // namespace ipl_slam
