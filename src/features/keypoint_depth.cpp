#include "features/keypoint_depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace ipl_slam {

float keypoint_depth(const cv::Mat& depth, float u, float v, const Camera& camera,
                     const DepthNoiseOptions& noise, const KeypointDepthOptions& options) {
  const int x = static_cast<int>(std::lround(u));
  const int y = static_cast<int>(std::lround(v));
  const int r = options.radius;
  std::uint16_t nearest = 0;  // to the keypoint
  int nearest_distance2 = std::numeric_limits<int>::max();
  std::uint16_t low = std::numeric_limits<std::uint16_t>::max();
  std::uint16_t high = 0;
  for (int j = std::max(0, y - r); j <= std::min(depth.rows - 1, y + r); ++j) {
    const auto* row = depth.ptr<std::uint16_t>(j);
    for (int i = std::max(0, x - r); i <= std::min(depth.cols - 1, x + r); ++i) {
      const std::uint16_t raw = row[i];
      if (raw == 0) continue;
      low = std::min(low, raw);
      high = std::max(high, raw);
      const int distance2 = (i - x) * (i - x) + (j - y) * (j - y);
      // Of equally near pixels the one in front: a corner belongs to what covers.
      if (distance2 < nearest_distance2 || (distance2 == nearest_distance2 && raw < nearest)) {
        nearest = raw;
        nearest_distance2 = distance2;
      }
    }
  }
  if (nearest == 0) return 0.0F;
  const double scale = camera.depth_scale;
  if (options.reject_edges && scale / low - scale / high > options.edge_gap) return 0.0F;
  const double z = nearest / scale;
  return z > noise.max_depth ? 0.0F : static_cast<float>(z);
}

}  // namespace ipl_slam
