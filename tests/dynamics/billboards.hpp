#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam::test {

/// A rectangle that stands in the world parallel to its x-y plane; metres.
struct Billboard {
  std::uint32_t id = 0;
  double x = 0.0, y = 0.0, z = 3.0;  ///< of its centre
  double width = 0.6, height = 1.0;
  std::string class_name = "person";
};

/// What a camera sees of billboards before a wall at z = 5 m.
struct BillboardView {
  cv::Mat depth;  ///< CV_16UC1
  std::vector<TrackedInstance> instances;
};

inline const Camera kBillboardCamera{
    .width = 320, .height = 240, .fx = 260.0, .fy = 260.0, .cx = 159.5, .cy = 119.5};

inline BillboardView look_at_billboards(const std::vector<Billboard>& boards, const SE3& T_wc,
                                        const Camera& camera = kBillboardCamera) {
  BillboardView view{cv::Mat(camera.height, camera.width, CV_16UC1), {}};
  for (const Billboard& board : boards) {
    TrackedInstance tracked;
    tracked.id = InstanceId{board.id};
    tracked.instance.class_name = board.class_name;
    tracked.instance.score = 0.9F;
    tracked.instance.mask = BitMask(view.depth.size());
    view.instances.push_back(tracked);
  }
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = T_wc.rotation() * camera.unproject(camera.undistort({u, v}), 1.0);
      const Eigen::Vector3d& eye = T_wc.translation();
      double depth = (5.0 - eye.z()) / ray.z();
      std::size_t nearest = boards.size();
      for (std::size_t i = 0; i < boards.size(); ++i) {
        const Billboard& board = boards[i];
        const double d = (board.z - eye.z()) / ray.z();
        const Eigen::Vector3d at = eye + d * ray;
        if (d <= 0.0 || d >= depth || std::abs(at.x() - board.x) > 0.5 * board.width ||
            std::abs(at.y() - board.y) > 0.5 * board.height) {
          continue;
        }
        depth = d;
        nearest = i;
      }
      view.depth.at<std::uint16_t>(v, u) = cv::saturate_cast<std::uint16_t>(depth * camera.depth_scale);
      if (nearest < boards.size()) view.instances[nearest].instance.mask.set(u, v);
    }
  }
  for (TrackedInstance& tracked : view.instances) tracked.instance.box = tracked.instance.mask.bounding_box();
  return view;
}

/// A camera at (x, y, z) that looks along world z, turned by `pan` radians about its y axis.
inline SE3 camera_pose(double x, double y = 0.0, double z = 0.0, double pan = 0.0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(pan, Eigen::Vector3d::UnitY())), Eigen::Vector3d(x, y, z)};
}

}  // namespace ipl_slam::test
