#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "features/features.hpp"

namespace ipl_slam {

/// Depth along a segment. The inverse depth of a straight line is an affine function of the position along
/// its image, so two values say it all.
struct SegmentDepth {
  float inverse_start = 0.0F, inverse_end = 0.0F;  ///< inverse depth at the end points, 1/m; 0 = not known
  /// Covariance of the two, 1/m^2: [start start, start end; start end, end end].
  Eigen::Matrix2f covariance = Eigen::Matrix2f::Zero();

  [[nodiscard]] bool known() const { return inverse_start > 0.0F && inverse_end > 0.0F; }
};

/// A straight edge in the image. It runs from start to end so that the brighter side lies on the right of
/// someone who walks along it, the side of ImageLine's positive distances (geometry/line3.hpp). Pixel
/// coordinates are of the full-size image, whatever scale it was found on.
struct LineSegment {
  Eigen::Vector2f start_pixel = Eigen::Vector2f::Zero();  ///< as it lies in the image (distorted)
  Eigen::Vector2f end_pixel = Eigen::Vector2f::Zero();
  Eigen::Vector2f start = Eigen::Vector2f::Zero();  ///< with the lens distortion removed
  Eigen::Vector2f end = Eigen::Vector2f::Zero();
  float contrast = 0.0F;  ///< mean step of the grey value across it, > 0
  int octave = 0;  ///< scale it was found on, 0 = full size; its position is known to about 2^octave pixels
  SegmentDepth depth;

  /// Undistorted length, pixels.
  [[nodiscard]] float length() const { return (end - start).norm(); }
};

/// What the line stage gives for one keyframe: segments and their LBD descriptors, index by index.
struct LineFeatures {
  std::vector<LineSegment> segments;
  std::vector<Descriptor> descriptors;

  [[nodiscard]] std::size_t size() const { return segments.size(); }
};

}  // namespace ipl_slam
