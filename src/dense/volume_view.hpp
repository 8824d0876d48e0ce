#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "dense/range_image.hpp"
#include "dense/tsdf_volume.hpp"
#include "dense/voxel_grid.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// A view from its pose, made ready for the voxels to look themselves up in. A function of range image, pose,
/// camera and options alone: a view is taken out as exactly what it was taken in as.
class VolumeView {
 public:
  /// What a view says along the ray of a pixel.
  struct Ray {
    float depth;      ///< of the surface, m; 0 = none
    float incidence;  ///< see RangeImage
    float through;    ///< up to this depth it is free for sure, m; 0 or below: nothing is
    float weight;     ///< of the surface, a whole number from 1 to kMaxWeight
  };
  static constexpr int kMaxWeight = 16;

  /// Where a voxel's centre lies in the picture: (u z, v z, z).
  using Homogeneous = Eigen::Vector3f;

  VolumeView(const RangeImage& range, const SE3& T_cw, const Camera& camera, const VolumeOptions& options);

  /// Blocks that the view's surface passes through with its band of +-truncation, each once, in an order
  /// that depends on the view alone. Rays are followed at distances of a fraction of a block.
  [[nodiscard]] std::vector<BlockCoord> surface_blocks() const;

  /// Depth up to which the rays that may pass through the block say something, m; 0 where the block surely
  /// lies outside the picture or behind all that.
  [[nodiscard]] float sight(const BlockCoord& block) const;

  /// Of the voxel with the lowest coordinates.
  [[nodiscard]] Homogeneous first_voxel(const BlockCoord& block) const;
  /// Columns: what that grows by from a voxel to the next along x, y and z of the world.
  [[nodiscard]] const Eigen::Matrix3f& voxel_steps() const { return voxel_steps_; }
  /// Weight of looking through the middle of a block.
  [[nodiscard]] int free_weight(const BlockCoord& block) const;

  [[nodiscard]] int width() const { return rays_.cols; }
  [[nodiscard]] int height() const { return rays_.rows; }
  /// By v * width() + u.
  [[nodiscard]] const Ray* rays() const { return rays_.ptr<Ray>(); }
  [[nodiscard]] float truncation() const { return static_cast<float>(options_.truncation); }

 private:
  static_assert(sizeof(Ray) == 4 * sizeof(float));

  void fill_rays(const RangeImage& range);
  [[nodiscard]] Eigen::Vector3d centre_in_camera(const BlockCoord& block) const;

  Camera camera_;
  VolumeOptions options_;
  double block_size_;
  Eigen::Matrix3d R_cw_;
  Eigen::Vector3d t_cw_;
  Eigen::Matrix3d projection_;    // K R_cw
  Eigen::Matrix3f voxel_steps_;   // projection_ x voxel size
  Eigen::Vector3d half_extents_;  // of a block's box along the axes of the camera
  cv::Mat rays_;                  // CV_32FC4, of Ray
  cv::Mat tiles_;                 // CV_32FC1: how far what is seen in a tile reaches, m
  double farthest_ = 0.0;         // depth of a surface, m
};

}  // namespace ipl_slam
