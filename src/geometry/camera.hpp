#pragma once

#include <string>

#include <Eigen/Core>

namespace ipl_slam {

/// Pinhole camera with radial-tangential (Brown-Conrady) distortion, as OpenCV and ROS define it:
/// coefficients k1 k2 p1 p2 k3. Pixel coordinates (u, v): u right, v down, (0, 0) the centre of the top-left
/// pixel.
struct Camera {
  std::string name = "custom";
  int width = 640, height = 480;                          ///< image size, pixels
  double fx = 525.0, fy = 525.0, cx = 319.5, cy = 239.5;  ///< pixels
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;
  double depth_scale = 5000.0;  ///< raw depth units per metre; raw 0 is "no depth"

  [[nodiscard]] bool distorted() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0; }

  /// Undistorted pixel of a camera-frame point with z > 0 (the distortion-free projection the optimisers
  /// use).
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& p_c) const {
    return {fx * p_c.x() / p_c.z() + cx, fy * p_c.y() / p_c.z() + cy};
  }
  /// Camera-frame point of an undistorted pixel at depth z (metres along the optical axis).
  [[nodiscard]] Eigen::Vector3d unproject(const Eigen::Vector2d& uv, double z) const {
    return {(uv.x() - cx) / fx * z, (uv.y() - cy) / fy * z, z};
  }
  /// Undistorted pixel of a pixel as it lies in the image. Newton iterations on the distortion model, to 1e-6
  /// pixel.
  [[nodiscard]] Eigen::Vector2d undistort(const Eigen::Vector2d& uv) const;
  /// Inverse of undistort: where an undistorted pixel lies in the image.
  [[nodiscard]] Eigen::Vector2d distort(const Eigen::Vector2d& uv) const;

  /// Throws UserError naming the first value that cannot be (focal length <= 0, size < 16, ...).
  void check() const;
};

}  // namespace ipl_slam
