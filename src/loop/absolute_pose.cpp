#include "loop/absolute_pose.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "geometry/alignment.hpp"
#include "geometry/perspective_three_point.hpp"
#include "geometry/reprojection.hpp"

namespace ipl_slam {
namespace {

class AbsolutePoseEstimator {
 public:
  using Model = SE3;  // T_cw
  static constexpr std::size_t kSampleSize = 3;

  AbsolutePoseEstimator(const Camera& camera, std::span<const PointMatch> matches, double threshold)
      : camera_(camera), matches_(matches), limit_(threshold * threshold) {}

  [[nodiscard]] std::size_t size() const { return matches_.size(); }

  [[nodiscard]] std::optional<SE3> fit(std::span<const std::uint32_t> indices) const {
    const bool measured =
        std::all_of(indices.begin(), indices.end(), [&](std::uint32_t i) { return matches_[i].depth > 0.0; });
    if (indices.size() > kSampleSize || measured) return rigid_motion(indices);
    return from_three_rays(indices);
  }

  [[nodiscard]] double squared_error(const SE3& T_cw, std::uint32_t i) const {
    const Eigen::Vector3d p_c = T_cw * matches_[i].point_w;
    if (p_c.z() < kMinProjectionDepth) return std::numeric_limits<double>::infinity();
    return (matches_[i].uv - camera_.project(p_c)).squaredNorm() / matches_[i].sigma2;
  }

 private:
  [[nodiscard]] std::optional<SE3> rigid_motion(std::span<const std::uint32_t> indices) const {
    std::vector<Eigen::Vector3d> points_w, points_c;
    for (const std::uint32_t i : indices) {
      if (matches_[i].depth <= 0.0) continue;
      points_w.push_back(matches_[i].point_w);
      points_c.push_back(camera_.unproject(matches_[i].uv, matches_[i].depth));
    }
    return align_rigid(points_w, points_c);
  }

  // Of the up to four poses, the one that most of all matches agree with.
  [[nodiscard]] std::optional<SE3> from_three_rays(std::span<const std::uint32_t> sample) const {
    std::array<Eigen::Vector3d, 3> points_w, rays;
    for (std::size_t k = 0; k < 3; ++k) {
      points_w[k] = matches_[sample[k]].point_w;
      rays[k] = camera_.unproject(matches_[sample[k]].uv, 1.0).normalized();
    }
    std::optional<SE3> best;
    double least = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& distances : three_point_distances(points_w, rays)) {
      const std::array<Eigen::Vector3d, 3> points_c{distances[0] * rays[0], distances[1] * rays[1],
                                                    distances[2] * rays[2]};
      const std::optional<SE3> T_cw = align_rigid(points_w, points_c);
      if (!T_cw) continue;
      const double total = cost(*T_cw);
      if (total < least) {
        least = total;
        best = T_cw;
      }
    }
    return best;
  }

  [[nodiscard]] double cost(const SE3& T_cw) const {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < matches_.size(); ++i) sum += std::min(limit_, squared_error(T_cw, i));
    return sum;
  }

  const Camera& camera_;
  std::span<const PointMatch> matches_;
  double limit_;
};

}  // namespace

std::optional<RansacResult<SE3>> absolute_pose(const Camera& camera, std::span<const PointMatch> matches,
                                               const RansacOptions& options, Random& random) {
  return ransac(AbsolutePoseEstimator(camera, matches, options.threshold), options, random);
}

}  // namespace ipl_slam
