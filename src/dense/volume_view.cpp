#include "dense/volume_view.hpp"

#include <algorithm>
#include <cmath>

#include "dense/block_set.hpp"

namespace ipl_slam {
namespace {

// Pixels a side. Blocks are about as large in the picture.
constexpr int kTile = 16;
// Rays that look for blocks lie at most this share of a block apart, steps along them too. The band that they
// follow is as thick as blocks by default, so that a block they miss is only touched at a corner.
constexpr double kBlockShare = 0.5;
// Pixels, however near everything is.
constexpr int kMaxStride = 8;
// The band about surfaces that are seen flatter than this is followed no further: 0.8 m to either side.
constexpr float kLeastIncidence = 0.05F;
// Pixels: outside of any picture, and still an int.
constexpr double kFarAside = 1e6;
// A surface's noise stays below this many standard deviations.
constexpr double kNoiseLimit = 3.0;

// m^2. Not quite 0, so that one may divide by it.
double pose_variance(const VolumeOptions& options) {
  constexpr double kLeast = 1e-12;
  return std::max(options.pose_sigma * options.pose_sigma, kLeast);
}

// As std::max, but by value: loops with it become vector code.
float larger(float a, float b) {
  return a > b ? a : b;
}

BlockCoord block_at(const Eigen::Vector3d& place_in_blocks) {
  return {static_cast<std::int32_t>(std::floor(place_in_blocks.x())),
          static_cast<std::int32_t>(std::floor(place_in_blocks.y())),
          static_cast<std::int32_t>(std::floor(place_in_blocks.z()))};
}

// What a column or row of pixels at most sees of a box from `low` to `high` (m, across the optical axis) at
// depths from `near` to `far`.
int first_pixel(double low, double near, double far, double f, double c) {
  return static_cast<int>(
      std::floor(std::clamp(f * low / (low < 0.0 ? near : far) + c, -kFarAside, kFarAside)));
}
int last_pixel(double high, double near, double far, double f, double c) {
  return static_cast<int>(
      std::ceil(std::clamp(f * high / (high > 0.0 ? near : far) + c, -kFarAside, kFarAside)));
}

}  // namespace

VolumeView::VolumeView(const RangeImage& range, const SE3& T_cw, const Camera& camera,
                       const VolumeOptions& options)
    : camera_(camera),
      options_(options),
      block_size_(options.voxel * VoxelBlock::kSide),
      R_cw_(T_cw.rotation_matrix()),
      t_cw_(T_cw.translation()) {
  Eigen::Matrix3d K;
  K << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  projection_ = K * R_cw_;
  voxel_steps_ = (options.voxel * projection_).cast<float>();
  half_extents_ = 0.5 * block_size_ * R_cw_.cwiseAbs() * Eigen::Vector3d::Ones();
  fill_rays(range);
}

void VolumeView::fill_rays(const RangeImage& range) {
  const cv::Size size(camera_.width, camera_.height);
  for (const cv::Mat* image : {&range.depth, &range.incidence, &range.reach}) {
    CV_Assert(image->type() == CV_32FC1 && image->size() == size);
  }
  cv::minMaxLoc(range.depth, nullptr, &farthest_);
  rays_.create(size, CV_32FC4);
  tiles_ = cv::Mat::zeros((size.height + kTile - 1) / kTile, (size.width + kTile - 1) / kTile, CV_32FC1);
  const auto columns = static_cast<std::size_t>(size.width);
  std::vector<float> x2(columns), ends(columns);
  for (std::size_t u = 0; u < columns; ++u) {
    x2[u] = static_cast<float>(std::pow((static_cast<double>(u) - camera_.cx) / camera_.fx, 2));
  }
  const auto pose2 = static_cast<float>(pose_variance(options_));
  const auto sigma = static_cast<float>(options_.depth_sigma);
  const auto margin_sigma = static_cast<float>(kNoiseLimit * options_.depth_sigma);
  const float full = static_cast<float>(kMaxWeight) * pose2, cut = truncation();
  for (int v = 0; v < size.height; ++v) {
    const auto* depth = range.depth.ptr<float>(v);
    const auto* incidence = range.incidence.ptr<float>(v);
    const auto* reach = range.reach.ptr<float>(v);
    auto* ray = rays_.ptr<Ray>(v);
    const auto y2_and_1 = static_cast<float>(1.0 + std::pow((v - camera_.cy) / camera_.fy, 2));
    for (std::size_t u = 0; u < columns; ++u) {
      const float d = depth[u], slant = incidence[u], r = reach[u];
      const float noise = sigma * d * d, noise_of_reach = margin_sigma * r * r;
      const float weight = full * slant / ((pose2 + noise * noise) * std::sqrt(x2[u] + y2_and_1)) + 0.5F;
      const int whole = static_cast<int>(weight);
      const float through = r - larger(cut, noise_of_reach);  // below 0 where there is no reach
      const float measured = d > 0.0F ? 1.0F : 0.0F;
      const float end = d + measured * (cut / larger(slant, kLeastIncidence));
      ray[u].depth = d;
      ray[u].incidence = slant;
      ray[u].through = through;
      ray[u].weight = static_cast<float>(std::max(std::min(whole, kMaxWeight), 1));
      ends[u] = larger(end, through);
    }
    auto* tile = tiles_.ptr<float>(v / kTile);
    for (std::size_t u = 0; u < columns; ++u) tile[u / kTile] = std::max(tile[u / kTile], ends[u]);
  }
}

std::vector<BlockCoord> VolumeView::surface_blocks() const {
  BlockSet blocks;
  if (farthest_ == 0.0) return {};
  const double spacing = kBlockShare * block_size_;
  const double focal = std::max(camera_.fx, camera_.fy);
  const int stride = std::clamp(static_cast<int>(spacing * focal / farthest_), 1, kMaxStride);
  // In blocks: their number is the integral part.
  const Eigen::Matrix3d R_wc = R_cw_.transpose() / block_size_;
  const Eigen::Vector3d eye = -(R_wc * t_cw_);
  BlockCoord last{};
  bool any = false;
  for (int v = stride / 2; v < height(); v += stride) {
    const Ray* row = rays_.ptr<Ray>(v);
    const double y = (v - camera_.cy) / camera_.fy;
    for (int u = stride / 2; u < width(); u += stride) {
      const Ray& ray = row[u];
      if (ray.depth == 0.0F) continue;
      const Eigen::Vector3d m((u - camera_.cx) / camera_.fx, y, 1.0);
      const double band = options_.truncation / std::max(ray.incidence, kLeastIncidence);
      const double low = std::max(ray.depth - band, 0.0), length = ray.depth + band - low;
      const int steps = static_cast<int>(std::ceil(length * m.norm() / spacing));
      const Eigen::Vector3d direction = R_wc * m;
      for (int i = 0; i <= steps; ++i) {
        const BlockCoord place = block_at(eye + (low + length * i / steps) * direction);
        if (any && place == last) continue;
        blocks.insert(place);
        last = place;
        any = true;
      }
    }
  }
  return std::move(blocks).take();
}

Eigen::Vector3d VolumeView::centre_in_camera(const BlockCoord& block) const {
  const Eigen::Vector3d centre(block.x + 0.5, block.y + 0.5, block.z + 0.5);
  return R_cw_ * (block_size_ * centre) + t_cw_;
}

float VolumeView::sight(const BlockCoord& block) const {
  const Eigen::Vector3d centre = centre_in_camera(block);
  const Eigen::Vector3d low = centre - half_extents_, high = centre + half_extents_;
  if (high.z() <= 0.0) return 0.0F;
  int left = 0, right = width() - 1, top = 0, bottom = height() - 1;
  // A block about the camera itself may be anywhere in the picture.
  if (low.z() > 0.01 * block_size_) {
    const auto& c = camera_;
    left = std::max(left, first_pixel(low.x(), low.z(), high.z(), c.fx, c.cx));
    right = std::min(right, last_pixel(high.x(), low.z(), high.z(), c.fx, c.cx));
    top = std::max(top, first_pixel(low.y(), low.z(), high.z(), c.fy, c.cy));
    bottom = std::min(bottom, last_pixel(high.y(), low.z(), high.z(), c.fy, c.cy));
    if (left > right || top > bottom) return 0.0F;
  }
  float farthest = 0.0F;
  for (int row = top / kTile; row <= bottom / kTile; ++row) {
    const auto* tile = tiles_.ptr<float>(row);
    for (int column = left / kTile; column <= right / kTile; ++column) {
      farthest = std::max(farthest, tile[column]);
    }
  }
  return low.z() < static_cast<double>(farthest) ? farthest : 0.0F;
}

VolumeView::Homogeneous VolumeView::first_voxel(const BlockCoord& block) const {
  const Eigen::Vector3d centre =
      options_.voxel * (VoxelBlock::kSide * Eigen::Vector3d(block.x, block.y, block.z).array() + 0.5);
  const Eigen::Vector3d t(camera_.fx * t_cw_.x() + camera_.cx * t_cw_.z(),
                          camera_.fy * t_cw_.y() + camera_.cy * t_cw_.z(), t_cw_.z());
  return (projection_ * centre + t).cast<float>();
}

int VolumeView::free_weight(const BlockCoord& block) const {
  const double z = centre_in_camera(block).z();
  const double pose2 = pose_variance(options_), noise = options_.depth_sigma * z * z;
  const double weight = kMaxWeight * pose2 / (pose2 + noise * noise);
  return std::max(1, static_cast<int>(std::lround(weight)));
}

}  // namespace ipl_slam
