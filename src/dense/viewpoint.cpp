#include "dense/viewpoint.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

namespace ipl_slam {
namespace {

constexpr double kStrays = 0.005;   // share of the points at either end of each axis that may lie outside
constexpr double kOutside = 0.001;  // share of the points that may lie outside the picture of an orbit
constexpr double kMargin = 1.08;    // of the picture beyond the cloud
constexpr double kLeastSize = 0.1;  // m; of a cloud of one point
constexpr double kFocal = 0.9;      // focal length in widths of the picture: 58 degrees, as a Kinect

struct Box {
  Eigen::Vector3d low, high;
  [[nodiscard]] Eigen::Vector3d middle() const { return 0.5 * (low + high); }
  [[nodiscard]] Eigen::Vector3d size() const { return (high - low).cwiseMax(kLeastSize); }
};

double quantile(std::vector<double>& values, double share) {
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

// Holds the cloud but for strays, in the upright frame.
Box box_of(const SemanticCloud& cloud, const SE3& T_uw) {
  Box box{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  if (cloud.points.empty()) return box;
  const Eigen::Matrix3d R = T_uw.rotation_matrix();
  std::vector<double> values(cloud.points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = R.row(axis).dot(cloud.points[i].position.cast<double>()) + T_uw.translation()[axis];
    }
    box.low[axis] = quantile(values, kStrays);
    box.high[axis] = quantile(values, 1.0 - kStrays);
  }
  return box;
}

// The pose of a view at `eye` towards `forward`, its x-axis level; both in the upright frame.
SE3 level_view(const Eigen::Vector3d& eye, const Eigen::Vector3d& forward) {
  const Eigen::Vector3d z = forward.normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R_uv;
  R_uv << x, z.cross(x), z;
  return SE3(R_uv, eye).inverse();
}

}  // namespace

Viewpoint top_view(const SemanticCloud& cloud, const Upright& upright, const cv::Size& size) {
  const Box box = box_of(cloud, upright.T_uw);
  Eigen::Matrix3d R_vu;
  R_vu << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  // So high that all lies in front of the view: strays under the ceiling, too.
  constexpr double kHigh = 100.0;
  const Eigen::Vector3d eye(box.middle().x(), box.middle().y(), box.high.z() + kHigh);
  Viewpoint view;
  view.T_vw = SE3(R_vu, -R_vu * eye) * upright.T_uw;
  view.size = size;
  view.orthographic = true;
  view.scale = std::min(size.width / box.size().x(), size.height / box.size().y()) / kMargin;
  return view;
}

Viewpoint orbit_view(const SemanticCloud& cloud, const Upright& upright, double azimuth, double elevation,
                     const cv::Size& size) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  // From straight above and below "level" says nothing: stay a little off.
  const double e = std::clamp(elevation, -89.9, 89.9) * kDegree, a = azimuth * kDegree;
  const Eigen::Vector3d out(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  const Box box = box_of(cloud, upright.T_uw);
  Viewpoint view;
  view.size = size;
  view.scale = kFocal * size.width;

  // At a distance d of the eye a point's depth is d + z, so |x| scale <= w/2 (d + z): so far it must be.
  const Eigen::Matrix3d R_vu = level_view(Eigen::Vector3d::Zero(), -out).rotation_matrix();
  std::vector<double> needed{kLeastSize};
  for (const CloudPoint& point : cloud.points) {
    const Eigen::Vector3d p = R_vu * (upright.T_uw * point.position.cast<double>() - box.middle());
    const double aside = std::max(std::abs(p.x()) / size.width, std::abs(p.y()) / size.height);
    needed.push_back(kMargin * 2.0 * view.scale * aside - p.z());
  }
  const double distance = quantile(needed, 1.0 - kOutside);
  view.T_vw = level_view(box.middle() + distance * out, -out) * upright.T_uw;
  return view;
}

Viewpoint trajectory_view(const SE3& T_wc, const Upright& upright, const cv::Size& size) {
  constexpr double kBehind = 1.2, kAbove = 0.25;  // m
  const SE3 T_uc = upright.T_uw * T_wc;
  const Eigen::Matrix3d R_uc = T_uc.rotation_matrix();
  const Eigen::Vector3d forward = R_uc.col(2);
  Viewpoint view;
  view.size = size;
  view.scale = kFocal * size.width;
  Eigen::Vector3d eye = T_uc.translation() - kBehind * forward;
  eye.z() += kAbove;
  const bool is_steep = forward.head<2>().norm() < 1e-3;
  const SE3 T_vu = is_steep ? SE3(R_uc, eye).inverse() : level_view(eye, forward);
  view.T_vw = T_vu * upright.T_uw;
  return view;
}

}  // namespace ipl_slam
