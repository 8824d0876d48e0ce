#include "features/orb_extractor.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "features/gaussian_blur.hpp"
#include "features/orientation.hpp"
#include "features/quadtree.hpp"

namespace ipl_slam {
namespace {

void check_options(const OrbOptions& o) {
  if (o.features < 1 || o.levels < 1 || o.scale_factor <= 1.0 || o.fast_min_threshold < 1 ||
      o.fast_threshold > 254 || o.fast_min_threshold > o.fast_threshold || o.cell_size < 1 ||
      o.spread < 0.0 || o.spread > 1.0 || o.depth.radius < 0) {
    throw std::invalid_argument(
        "OrbOptions: features, levels, cell_size >= 1, scale_factor > 1 and "
        "1 <= fast_min_threshold <= fast_threshold <= 254, 0 <= spread <= 1 and depth.radius >= 0 are "
        "needed");
  }
}

// Keeps corners above `threshold`, and the weaker ones of cells that have none above it.
void apply_adaptive_threshold(std::vector<Corner>& corners, const cv::Rect& area, int cell_size,
                              int threshold) {
  const int columns = (area.width + cell_size - 1) / cell_size;
  const int rows = (area.height + cell_size - 1) / cell_size;
  std::vector<std::uint8_t> has_strong(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  const auto cell_of = [&](const Corner& c) {
    return static_cast<std::size_t>((c.y - area.y) / cell_size * columns + (c.x - area.x) / cell_size);
  };
  for (const Corner& c : corners) {
    if (c.score > threshold) has_strong[cell_of(c)] = 1;
  }
  std::erase_if(corners,
                [&](const Corner& c) { return c.score <= threshold && has_strong[cell_of(c)] != 0; });
}

struct Offset {
  float x = 0.0F, y = 0.0F;
};

// Summit of the parabola through a score maximum and its two neighbours. The middle one is the largest, so
// the summit lies within half a pixel; three equal scores have it in the middle.
float parabola_summit(int before, int middle, int after) {
  const int curvature = before + after - 2 * middle;
  return curvature < 0 ? 0.5F * static_cast<float>(before - after) / static_cast<float>(curvature) : 0.0F;
}

// Fitting the corner score locates a corner better than fitting its image gradients (Foerstner) does: the
// score is what repeats between frames.
Offset refine_corner(const cv::Mat& score, const Corner& corner) {
  const std::uint8_t* p = score.ptr(corner.y, corner.x);
  const auto step = static_cast<std::ptrdiff_t>(score.step);
  return {parabola_summit(p[-1], p[0], p[1]), parabola_summit(p[-step], p[0], p[step])};
}

}  // namespace

std::vector<double> level_sigma2(const OrbOptions& options) {
  std::vector<double> sigma2(static_cast<std::size_t>(options.levels));
  for (std::size_t i = 0; i < sigma2.size(); ++i) {
    sigma2[i] = std::pow(options.scale_factor, 2.0 * static_cast<double>(i));
  }
  return sigma2;
}

std::vector<int> level_quotas(const OrbOptions& options, double factor) {
  const double ratio = 1.0 / options.scale_factor;
  double share = factor * options.features * (1.0 - ratio) / (1.0 - std::pow(ratio, options.levels));
  std::vector<int> quotas(static_cast<std::size_t>(options.levels));
  double wanted = 0.0;
  int given = 0;
  for (int& quota : quotas) {
    wanted += share;
    quota = static_cast<int>(std::lround(wanted)) - given;  // rounding errors do not add up
    given += quota;
    share *= ratio;
  }
  return quotas;
}

OrbExtractor::OrbExtractor(const OrbOptions& options, const Camera& camera, const DepthNoiseOptions& noise,
                           ThreadPool* pool)
    : options_(options), camera_(camera), noise_(noise), pool_(pool) {
  check_options(options);
  double scale = 1.0;
  for (int i = 0; i < options.levels; ++i, scale *= options.scale_factor) {
    const int width = static_cast<int>(std::lround(camera.width / scale));
    const int height = static_cast<int>(std::lround(camera.height / scale));
    if (std::min(width, height) <= 2 * kPatchBorder) break;
    Level level;
    level.image.create(height, width, CV_8UC1);
    level.smooth.create(height, width, CV_8UC1);
    level.score = cv::Mat::zeros(height, width, CV_8UC1);
    level.area = {kPatchBorder, kPatchBorder, width - 2 * kPatchBorder, height - 2 * kPatchBorder};
    level.scale_x = static_cast<double>(camera.width) / width;
    level.scale_y = static_cast<double>(camera.height) / height;
    levels_.push_back(std::move(level));
  }
}

void OrbExtractor::check(const cv::Mat& image, const cv::Mat& depth) const {
  const cv::Size size(camera_.width, camera_.height);
  if (image.type() != CV_8UC1 && image.type() != CV_8UC3) {
    throw std::invalid_argument("the color image must be 8-bit with one or three channels");
  }
  if (!depth.empty() && depth.type() != CV_16UC1) {
    throw std::invalid_argument("the depth image must be 16-bit with one channel");
  }
  if (image.size() != size || (!depth.empty() && depth.size() != size)) {
    throw std::invalid_argument(
        fmt::format("the images must have the camera's size of {}x{}; color has {}x{}, depth {}x{}",
                    size.width, size.height, image.cols, image.rows, depth.cols, depth.rows));
  }
}

void OrbExtractor::build_pyramid(const cv::Mat& image) {
  if (levels_.empty()) return;
  if (image.channels() == 3) {
    cv::cvtColor(image, levels_[0].image, cv::COLOR_BGR2GRAY);
  } else {
    image.copyTo(levels_[0].image);
  }
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    cv::resize(levels_[i - 1].image, levels_[i].image, levels_[i].image.size(), 0, 0, cv::INTER_LINEAR);
  }
}

void OrbExtractor::detect(Level& level) const {
  level.corners.clear();
  fast_score(level.image, level.area, options_.fast_min_threshold, level.score);
  find_score_maxima(level.score, level.area, level.corners);
  apply_adaptive_threshold(level.corners, level.area, options_.cell_size, options_.fast_threshold);
}

void OrbExtractor::choose_corners(double factor) {
  const std::vector<int> quotas = level_quotas(options_, factor);
  // What a level cannot give, the next ones may: a blurred image has its corners on the coarse levels.
  int missing = 0;
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    const int wanted = quotas[i] + missing;
    const int given = std::min(wanted, static_cast<int>(levels_[i].corners.size()));
    missing = wanted - given;
    levels_[i].chosen.assign(static_cast<std::size_t>(given), 0);
  }
}

void OrbExtractor::describe(std::size_t index, const cv::Mat& depth) {
  Level& level = levels_[index];
  Features& features = level.features;
  features.keypoints.clear();
  features.descriptors.clear();
  const int quota = static_cast<int>(level.chosen.size());
  if (quota == 0) return;
  level.chosen = spread_evenly(level.corners, level.area, quota, options_.spread);
  gaussian_blur_7x7(level.image, level.smooth);
  const auto step = static_cast<std::ptrdiff_t>(level.image.step);
  for (const int i : level.chosen) {
    const Corner& corner = level.corners[static_cast<std::size_t>(i)];
    const Offset offset = options_.refine ? refine_corner(level.score, corner) : Offset{};
    Keypoint k;
    k.level = static_cast<int>(index);
    k.response = corner.score;
    k.angle = patch_orientation(level.image.ptr(corner.y, corner.x), step);
    // Pixel centres lie at whole coordinates, so half a pixel is taken to the border before scaling, and back
    // after.
    const double u = (corner.x + offset.x + 0.5) * level.scale_x - 0.5;
    const double v = (corner.y + offset.y + 0.5) * level.scale_y - 0.5;
    k.pixel = Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v));
    k.undistorted = camera_.undistort(Eigen::Vector2d(u, v)).cast<float>();
    if (!depth.empty())
      k.depth = keypoint_depth(depth, k.pixel.x(), k.pixel.y(), camera_, noise_, options_.depth);
    features.keypoints.push_back(k);
    features.descriptors.push_back(describer_.describe(
        level.smooth.ptr(corner.y, corner.x), static_cast<std::ptrdiff_t>(level.smooth.step), k.angle));
  }
}

void OrbExtractor::for_each_level(const std::function<void(std::size_t)>& fn) {
  if (pool_ != nullptr) {
    pool_->parallel_for(levels_.size(), fn);
  } else {
    for (std::size_t i = 0; i < levels_.size(); ++i) fn(i);
  }
}

Features OrbExtractor::extract(const cv::Mat& image, const cv::Mat& depth, double factor) {
  check(image, depth);
  build_pyramid(image);
  for_each_level([this](std::size_t i) { detect(levels_[i]); });
  choose_corners(factor);
  for_each_level([this, &depth](std::size_t i) { describe(i, depth); });
  Features all;
  for (const Level& level : levels_) {
    all.keypoints.insert(all.keypoints.end(), level.features.keypoints.begin(),
                         level.features.keypoints.end());
    all.descriptors.insert(all.descriptors.end(), level.features.descriptors.begin(),
                           level.features.descriptors.end());
  }
  return all;
}

}  // namespace ipl_slam
