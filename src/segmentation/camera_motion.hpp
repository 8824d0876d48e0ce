#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "dataset/rgbd_frame.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

struct CameraMotionOptions {
  int image_width = 320;        ///< of the image that corners are followed in, pixels
  int cell = 16;                ///< one landmark per square of this side, in that image, pixels
  double min_corner = 4e-4;     ///< least eigenvalue of the structure tensor (grey values 0 to 1)
  double pixel_sigma = 1.0;     ///< error of a followed corner, pixels of the full image
  double inverse_sigma = 0.01;  ///< error of measured inverse depth, 1/m
  int trust_frames = 15;        ///< frames after which a landmark that stays put is fully trusted
  int min_landmarks = 12;       ///< fewer that agree on a pose: the camera is lost

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("image_width", image_width, {64, 4096, "px", "width of the image that corners are followed in"});
    v.number("cell", cell, {4, 256, "px", "one landmark per square of this side"});
    v.number("min_corner", min_corner,
             {0.0, 1.0, "", "least eigenvalue of the structure tensor at a landmark, grey values 0 to 1"});
    v.number("pixel_sigma", pixel_sigma, {0.01, 20.0, "px", "error of a followed corner, full image"});
    v.number("inverse_sigma", inverse_sigma, {1e-5, 1.0, "1/m", "error of measured inverse depth"});
    v.number("trust_frames", trust_frames,
             {1, 1000, "count", "frames after which a landmark that stays put is fully trusted"});
    v.number("min_landmarks", min_landmarks,
             {4, 1000, "count", "fewer landmarks that agree on a pose: the camera is lost"});
  }
};

/// The camera's own motion, from landmarks that are followed through the images with pyramidal Lucas-Kanade
/// flow (Bouguet, "Pyramidal implementation of the Lucas Kanade feature tracker", 2000) and have a fixed
/// place in the world. What makes it robust against scenes that mostly move: landmarks are spread evenly, and
/// count the more the longer they have stayed put, so newcomers cannot outvote what has proved to be static.
class CameraMotion {
 public:
  /// Its samples depend on the number of the frame and on `seed`.
  CameraMotion(const Camera& camera, const CameraMotionOptions& options, std::uint64_t seed = 0);

  /// T_wc of the frame; the world is the camera frame of the first frame since the start or since the camera
  /// was lost. Nothing if it is lost now: then the next frame starts a new world. grey: CV_8UC1 of full size.
  [[nodiscard]] std::optional<SE3> track(const cv::Mat& grey, const cv::Mat& depth, double timestamp);
  /// To be called after track(): gives up the landmarks on what moves, and adds new ones elsewhere. moving:
  /// CV_8UC1 of any size laid over the image, not 0 where something moves.
  void renew_landmarks(const cv::Mat& moving);

 private:
  struct Landmark {
    cv::Point2f pixel;    // in the reduced image of the last frame
    Eigen::Vector3d p_w;  // metres
    int age = 0;          // frames in which it was where it should be
  };
  struct Observation;

  void reset();
  [[nodiscard]] SE3 predicted(double timestamp) const;
  [[nodiscard]] std::vector<Observation> follow(const SE3& T_cw_predicted) const;
  [[nodiscard]] std::optional<SE3> sampled_pose(const std::vector<Observation>& seen) const;
  [[nodiscard]] double cost(const SE3& T_cw, const std::vector<Observation>& seen) const;
  [[nodiscard]] SE3 refined(SE3 T_cw, const std::vector<Observation>& seen) const;
  [[nodiscard]] double chi2(const SE3& T_cw, const Observation& o) const;
  [[nodiscard]] Eigen::Vector2d full_pixel(const cv::Point2f& p) const;
  [[nodiscard]] cv::Point2f reduced_pixel(const Eigen::Vector2d& uv) const;

  Camera camera_;
  CameraMotionOptions options_;
  std::uint64_t seed_;
  double scale_;  // full pixels per reduced pixel
  cv::Size reduced_size_;

  cv::Mat image_, depth_;                       // of the newest frame; image reduced
  std::vector<cv::Mat> pyramid_, old_pyramid_;  // of the newest frame and the one before
  std::vector<Landmark> landmarks_;
  SE3 T_wc_, velocity_;  // velocity: T_(previous camera)(camera) per velocity_time_
  double timestamp_ = 0.0, velocity_time_ = 0.0;
  bool started_ = false;
  std::uint64_t frames_ = 0;
};

}  // namespace ipl_slam
