#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "dense/dense_view.hpp"
#include "geometry/camera.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam {

/// The camera that undistorted images fit: the same size, focal lengths and centre, no distortion.
[[nodiscard]] Camera pinhole(const Camera& camera);

/// Makes of a keyframe what the cloud keeps of it: undistorted images, instances drawn into one of them.
class ViewMaker {
 public:
  explicit ViewMaker(const Camera& camera);

  /// color: CV_8UC3 (BGR) or CV_8UC1. depth: CV_16UC1. Both of the camera's size; they are not written to,
  /// and where there is nothing to do the view shares their pixels. instances: as they lie in the image. Of
  /// instances that overlap, what moves by itself (class_role) comes before the rest, then the higher score.
  /// Of more than 255 the best in that order are kept.
  ///
  /// Depth and labels are those of the nearest pixel, as a mean of two depths lies on neither surface; 0
  /// where the camera saw nothing. Colour is interpolated.
  [[nodiscard]] DenseView make(double timestamp, const cv::Mat& color, const cv::Mat& depth,
                               const std::vector<TrackedInstance>& instances) const;

 private:
  [[nodiscard]] cv::Mat undistorted(const cv::Mat& image, bool nearest) const;

  cv::Size size_;
  // As cv::convertMaps makes them; empty without distortion.
  cv::Mat nearest_map_, linear_map_, linear_weights_;
};

}  // namespace ipl_slam
