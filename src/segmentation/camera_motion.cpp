#include "segmentation/camera_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "common/random.hpp"
#include "features/keypoint_depth.hpp"
#include "geometry/alignment.hpp"
#include "geometry/ransac.hpp"
#include "geometry/reprojection.hpp"
#include "geometry/robust.hpp"

namespace ipl_slam {

namespace {

const cv::Size kFlowWindow{11, 11};
constexpr int kFlowLevels = 3;  // beside the full one: follows errors of the prediction up to about 40 pixels
constexpr int kFlowIterations = 15;
constexpr double kFlowConverged = 0.02;  // pixels, a fifth of what flow is good for
constexpr int kSamples = 100;            // finds a pose even if two thirds of the landmarks move
constexpr double kSampleOutlier = 3.0;   // standard deviations of a pixel
constexpr int kPoseIterations = 10;
constexpr double kConverged = 1e-6;  // of a pose step, metres and radians
constexpr int kCornerWindow = 3;     // of the structure tensor, pixels

// Beyond this many squared standard deviations an observation is an outlier.
constexpr double kOutlier = kChi2For3Dof;

}  // namespace

// A landmark as the current frame shows it.
struct CameraMotion::Observation {
  std::size_t landmark = 0;
  Eigen::Vector3d p_w;
  cv::Point2f pixel;            // reduced image
  Eigen::Vector2d undistorted;  // full image
  double inverse_depth = 0.0;   // 0 = none
  double trust = 0.0;           // 0 to 1
};

namespace {

// Rigid alignment of three points, judged by what it does to the pixels: there the error does not depend on
// the distance.
class PixelEstimator {
 public:
  using Model = SE3;  // T_cw
  static constexpr std::size_t kSampleSize = 3;

  PixelEstimator(const Camera& camera, std::vector<Eigen::Vector3d> points_w,
                 std::vector<Eigen::Vector3d> points_c)
      : camera_(camera), points_w_(std::move(points_w)), points_c_(std::move(points_c)) {}

  [[nodiscard]] std::size_t size() const { return points_w_.size(); }
  [[nodiscard]] std::optional<SE3> fit(std::span<const std::uint32_t> indices) const {
    return RigidAlignmentEstimator(points_w_, points_c_).fit(indices);
  }
  [[nodiscard]] double squared_error(const SE3& T_cw, std::uint32_t i) const {
    const Eigen::Vector3d p = T_cw * points_w_[i];
    if (p.z() < kMinProjectionDepth) return kBehindCameraChi2;
    return (camera_.project(p) - camera_.project(points_c_[i])).squaredNorm();
  }

 private:
  const Camera& camera_;
  std::vector<Eigen::Vector3d> points_w_, points_c_;
};

}  // namespace

CameraMotion::CameraMotion(const Camera& camera, const CameraMotionOptions& options, std::uint64_t seed)
    : camera_(camera), options_(options), seed_(seed) {
  reduced_size_.width = std::min(options.image_width, camera.width);
  scale_ = static_cast<double>(camera.width) / reduced_size_.width;
  reduced_size_.height = std::max(1, static_cast<int>(std::lround(camera.height / scale_)));
}

// Pixel centres: a reduced pixel covers scale_ full pixels.
Eigen::Vector2d CameraMotion::full_pixel(const cv::Point2f& p) const {
  return {(p.x + 0.5) * scale_ - 0.5, (p.y + 0.5) * scale_ - 0.5};
}

cv::Point2f CameraMotion::reduced_pixel(const Eigen::Vector2d& uv) const {
  return {static_cast<float>((uv.x() + 0.5) / scale_ - 0.5),
          static_cast<float>((uv.y() + 0.5) / scale_ - 0.5)};
}

void CameraMotion::reset() {
  landmarks_.clear();
  T_wc_ = SE3();
  velocity_ = SE3();
  velocity_time_ = 0.0;
  started_ = false;
}

SE3 CameraMotion::predicted(double timestamp) const {
  if (velocity_time_ <= 0.0) return T_wc_;
  return T_wc_ * SE3::exp(velocity_.log() * ((timestamp - timestamp_) / velocity_time_));
}

std::optional<SE3> CameraMotion::track(const cv::Mat& grey, const cv::Mat& depth, double timestamp) {
  std::swap(pyramid_, old_pyramid_);
  if (grey.size() == reduced_size_) {
    image_ = grey;
  } else {
    cv::resize(grey, image_, reduced_size_, 0, 0, cv::INTER_AREA);
  }
  pyramid_.clear();
  cv::buildOpticalFlowPyramid(image_, pyramid_, kFlowWindow, kFlowLevels);
  depth_ = depth;
  ++frames_;
  if (!started_) {
    started_ = true;
    timestamp_ = timestamp;
    return T_wc_;
  }

  const SE3 guess = predicted(timestamp).inverse();
  const std::vector<Observation> seen = follow(guess);
  SE3 start = guess;
  if (const std::optional<SE3> sampled = sampled_pose(seen);
      sampled && cost(*sampled, seen) < cost(guess, seen)) {
    start = *sampled;
  }
  const SE3 T_cw = refined(start, seen);

  std::vector<Landmark> kept;
  int agreeing = 0;
  for (const Observation& o : seen) {
    if (chi2(T_cw, o) > kOutlier) continue;
    Landmark landmark = landmarks_[o.landmark];
    landmark.pixel = o.pixel;
    ++landmark.age;
    ++agreeing;
    kept.push_back(landmark);
  }
  if (agreeing < options_.min_landmarks) {
    reset();
    return std::nullopt;
  }
  landmarks_ = std::move(kept);
  const SE3 T_wc = T_cw.inverse();
  velocity_ = T_wc_.inverse() * T_wc;
  velocity_time_ = timestamp - timestamp_;
  T_wc_ = T_wc;
  timestamp_ = timestamp;
  return T_wc_;
}

std::vector<CameraMotion::Observation> CameraMotion::follow(const SE3& T_cw) const {
  std::vector<cv::Point2f> from, to;
  for (const Landmark& landmark : landmarks_) {
    from.push_back(landmark.pixel);
    const Eigen::Vector3d p_c = T_cw * landmark.p_w;
    to.push_back(p_c.z() < kMinProjectionDepth ? landmark.pixel
                                               : reduced_pixel(camera_.distort(camera_.project(p_c))));
  }
  std::vector<Observation> seen;
  if (from.empty()) return seen;
  std::vector<std::uint8_t> found;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(
      old_pyramid_, pyramid_, from, to, found, error, kFlowWindow, kFlowLevels,
      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, kFlowIterations, kFlowConverged),
      cv::OPTFLOW_USE_INITIAL_FLOW);
  const cv::Rect2f inside(0, 0, static_cast<float>(reduced_size_.width),
                          static_cast<float>(reduced_size_.height));
  for (std::size_t i = 0; i < to.size(); ++i) {
    if (!found[i] || !inside.contains(to[i])) continue;
    const Eigen::Vector2d full = full_pixel(to[i]);
    Observation o;
    o.landmark = i;
    o.p_w = landmarks_[i].p_w;
    o.pixel = to[i];
    o.undistorted = camera_.undistort(full);
    const float z =
        keypoint_depth(depth_, static_cast<float>(full.x()), static_cast<float>(full.y()), camera_, {}, {});
    o.inverse_depth = z > 0.0F ? 1.0 / z : 0.0;
    o.trust = std::min(1.0, (landmarks_[i].age + 1.0) / options_.trust_frames);
    seen.push_back(o);
  }
  return seen;
}

std::optional<SE3> CameraMotion::sampled_pose(const std::vector<Observation>& seen) const {
  // From the most trusted alone, if they are twice as many as a pose needs.
  const auto trusted = [](const Observation& o) { return o.trust >= 1.0; };
  const bool all = std::count_if(seen.begin(), seen.end(), trusted) < 2 * options_.min_landmarks;
  std::vector<Eigen::Vector3d> points_w, points_c;
  for (const Observation& o : seen) {
    if (o.inverse_depth == 0.0 || !(all || trusted(o))) continue;
    points_w.push_back(o.p_w);
    points_c.push_back(camera_.unproject(o.undistorted, 1.0 / o.inverse_depth));
  }
  RansacOptions ransac_options;
  ransac_options.threshold = kSampleOutlier * options_.pixel_sigma;
  ransac_options.max_iterations = kSamples;
  Random random(seeded(frames_, seed_));
  const auto result =
      ransac(PixelEstimator(camera_, std::move(points_w), std::move(points_c)), ransac_options, random);
  if (!result) return std::nullopt;
  return result->model;
}

double CameraMotion::chi2(const SE3& T_cw, const Observation& o) const {
  const Eigen::Vector3d p = T_cw * o.p_w;
  if (p.z() < kMinProjectionDepth) return kBehindCameraChi2;
  const double pixels = (o.undistorted - camera_.project(p)).squaredNorm();
  const double inverse = o.inverse_depth > 0.0 ? o.inverse_depth - 1.0 / p.z() : 0.0;
  return pixels / (options_.pixel_sigma * options_.pixel_sigma) +
         inverse * inverse / (options_.inverse_sigma * options_.inverse_sigma);
}

double CameraMotion::cost(const SE3& T_cw, const std::vector<Observation>& seen) const {
  double sum = 0.0;
  for (const Observation& o : seen) sum += o.trust * std::min(chi2(T_cw, o), kOutlier);
  return sum;
}

SE3 CameraMotion::refined(SE3 T_cw, const std::vector<Observation>& seen) const {
  const std::array<double, 3> information{1.0 / (options_.pixel_sigma * options_.pixel_sigma),
                                          1.0 / (options_.pixel_sigma * options_.pixel_sigma),
                                          1.0 / (options_.inverse_sigma * options_.inverse_sigma)};
  for (int iteration = 0; iteration < kPoseIterations; ++iteration) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    for (const Observation& o : seen) {
      const Eigen::Vector3d p = T_cw * o.p_w;
      if (p.z() < kMinProjectionDepth) continue;
      // Geman-McClure's weight: outliers end with none, while the steps still see what is a little too far.
      const double ratio = kOutlier / (kOutlier + chi2(T_cw, o));
      const double weight = o.trust * ratio * ratio;
      PointResidual<double> residual;
      point_residual(camera_, p.x(), p.y(), p.z(), o.undistorted.x(), o.undistorted.y(), o.inverse_depth,
                     residual);
      const int rows = o.inverse_depth > 0.0 ? 3 : 2;
      for (int row = 0; row < rows; ++row) {
        const Eigen::Map<const Vector6d> j(residual.jacobian[row]);
        H.noalias() += weight * information[static_cast<std::size_t>(row)] * j * j.transpose();
        g.noalias() += weight * information[static_cast<std::size_t>(row)] * residual.e[row] * j;
      }
    }
    H.diagonal().array() += 1e-6;  // keeps a scene that leaves a direction open solvable
    const Vector6d step = -H.ldlt().solve(g);
    if (!step.allFinite()) break;
    T_cw = SE3::exp(step) * T_cw;
    if (step.norm() < kConverged) break;
  }
  return T_cw;
}

void CameraMotion::renew_landmarks(const cv::Mat& moving) {
  if (!started_) return;
  const auto on_mover = [&](const cv::Point2f& p) {
    const int x = std::clamp(static_cast<int>(p.x * moving.cols / reduced_size_.width), 0, moving.cols - 1);
    const int y = std::clamp(static_cast<int>(p.y * moving.rows / reduced_size_.height), 0, moving.rows - 1);
    return moving.at<std::uint8_t>(y, x) != 0;
  };
  std::erase_if(landmarks_, [&](const Landmark& landmark) { return on_mover(landmark.pixel); });

  const int columns = (reduced_size_.width + options_.cell - 1) / options_.cell;
  const int rows = (reduced_size_.height + options_.cell - 1) / options_.cell;
  std::vector<bool> taken(static_cast<std::size_t>(columns * rows));
  for (const Landmark& landmark : landmarks_) {
    const int x = static_cast<int>(landmark.pixel.x) / options_.cell;
    const int y = static_cast<int>(landmark.pixel.y) / options_.cell;
    taken[static_cast<std::size_t>(y * columns + x)] = true;
  }
  cv::Mat corner;
  cv::cornerMinEigenVal(image_, corner, kCornerWindow);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (taken[static_cast<std::size_t>(y * columns + x)]) continue;
      const cv::Rect cell = cv::Rect(x * options_.cell, y * options_.cell, options_.cell, options_.cell) &
                            cv::Rect({0, 0}, reduced_size_);
      double best = 0.0;
      cv::Point where;
      cv::minMaxLoc(corner(cell), nullptr, &best, nullptr, &where);
      if (best < options_.min_corner) continue;
      const cv::Point2f pixel(where + cell.tl());
      if (on_mover(pixel)) continue;
      const Eigen::Vector2d full = full_pixel(pixel);
      const float z =
          keypoint_depth(depth_, static_cast<float>(full.x()), static_cast<float>(full.y()), camera_, {}, {});
      if (z <= 0.0F) continue;
      landmarks_.push_back({pixel, T_wc_ * camera_.unproject(camera_.undistort(full), z), 0});
    }
  }
}

}  // namespace ipl_slam
