#include "evaluation/view_overlap.hpp"

#include <cmath>

namespace ipl_slam {
namespace {

constexpr int kTried = 4;

}  // namespace

DepthView make_depth_view(const cv::Mat& depth, const SE3& T_wc, const Camera& camera,
                          const BitMask& moving) {
  DepthView view{T_wc,
                 cv::Mat::zeros(depth.rows / DepthView::kStep, depth.cols / DepthView::kStep, CV_32FC1)};
  const bool masked = moving.size() == depth.size();
  for (int y = 0; y < view.depth.rows; ++y) {
    for (int x = 0; x < view.depth.cols; ++x) {
      const Eigen::Vector2d pixel = camera.distort(Eigen::Vector2d(x, y) * DepthView::kStep);
      const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
      if (!cv::Rect({}, depth.size()).contains(at) || (masked && moving.test(at.x, at.y))) continue;
      view.depth.at<float>(y, x) = static_cast<float>(depth.at<std::uint16_t>(at) / camera.depth_scale);
    }
  }
  return view;
}

double seen_share(const DepthView& a, const DepthView& b, const Camera& camera) {
  const SE3 T_ba = b.T_wc.inverse() * a.T_wc;
  const Eigen::Matrix3d R_ba = T_ba.rotation_matrix();
  int tried = 0, seen = 0;
  for (int y = 0; y < a.depth.rows; y += kTried) {
    for (int x = 0; x < a.depth.cols; x += kTried) {
      const double z = a.depth.at<float>(y, x);
      if (z <= 0.0) continue;
      ++tried;
      const Eigen::Vector3d p_b =
          R_ba * camera.unproject(Eigen::Vector2d(x, y) * DepthView::kStep, z) + T_ba.translation();
      if (p_b.z() <= 0.0) continue;
      const Eigen::Vector2d at = camera.project(p_b) / DepthView::kStep;
      if (!(at.x() > -0.5 && at.y() > -0.5 && at.x() < b.depth.cols - 0.5 && at.y() < b.depth.rows - 0.5)) {
        continue;
      }
      const double measured =
          b.depth.at<float>(static_cast<int>(std::lround(at.y())), static_cast<int>(std::lround(at.x())));
      seen += std::abs(measured - p_b.z()) <= kOverlapTolerance * p_b.z() ? 1 : 0;
    }
  }
  return tried > 0 ? static_cast<double>(seen) / tried : 0.0;
}

}  // namespace ipl_slam
