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
// A surface's noise stays below this many standard deviations.
constexpr double kNoiseLimit = 3.0;

BlockCoord block_at(const Eigen::Vector3d& place_in_blocks) {
  return {static_cast<std::int32_t>(std::floor(place_in_blocks.x())),
          static_cast<std::int32_t>(std::floor(place_in_blocks.y())),
          static_cast<std::int32_t>(std::floor(place_in_blocks.z()))};
}

// What a column or row of pixels at most sees of a box from `low` to `high` (m, across the optical axis) at
// depths from `near` to `far`.
int first_pixel(double low, double near, double far, double f, double c) {
  return static_cast<int>(std::floor(f * low / (low < 0.0 ? near : far) + c));
}
int last_pixel(double high, double near, double far, double f, double c) {
  return static_cast<int>(std::ceil(f * high / (high > 0.0 ? near : far) + c));
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
  rays_.create(size, CV_32FC4);
  tiles_ = cv::Mat::zeros((size.height + kTile - 1) / kTile, (size.width + kTile - 1) / kTile, CV_32FC1);
  const auto columns = static_cast<std::size_t>(size.width);
  std::vector<float> x2(columns), reaches(columns);
  for (std::size_t u = 0; u < columns; ++u) {
    x2[u] = static_cast<float>(std::pow((static_cast<double>(u) - camera_.cx) / camera_.fx, 2));
  }
  const auto pose2 = static_cast<float>(options_.pose_sigma * options_.pose_sigma);
  const auto sigma = static_cast<float>(options_.depth_sigma);
  const auto margin_sigma = static_cast<float>(kNoiseLimit * options_.depth_sigma);
  const float cut = truncation();
  for (int v = 0; v < size.height; ++v) {
    const auto* depth = range.depth.ptr<float>(v);
    const auto* incidence = range.incidence.ptr<float>(v);
    const auto* reach = range.reach.ptr<float>(v);
    auto* ray = rays_.ptr<Ray>(v);
    const auto y2_and_1 = static_cast<float>(1.0 + std::pow((v - camera_.cy) / camera_.fy, 2));
    for (std::size_t u = 0; u < columns; ++u) {
      const float d = depth[u], r = reach[u];
      const float noise = sigma * d * d;
      const float weight = static_cast<float>(kMaxWeight) * pose2 * incidence[u] /
                           ((pose2 + noise * noise) * std::sqrt(x2[u] + y2_and_1));
      const float whole =
          static_cast<float>(static_cast<int>(std::min(weight, static_cast<float>(kMaxWeight)) + 0.5F));
      const float through = r > 0.0F ? r - std::max(cut, margin_sigma * r * r) : 0.0F;
      ray[u] = {d, incidence[u], through, std::max(whole, 1.0F)};
      const float behind = d > 0.0F ? d + cut / incidence[u] : 0.0F;
      reaches[u] = std::max(behind, through);
      farthest_ = std::max(farthest_, d);
    }
    auto* tile = tiles_.ptr<float>(v / kTile);
    for (std::size_t u = 0; u < columns; ++u) tile[u / kTile] = std::max(tile[u / kTile], reaches[u]);
  }
}

std::vector<BlockCoord> VolumeView::surface_blocks() const {
  BlockSet blocks;
  if (farthest_ == 0.0F) return {};
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
      const double band = options_.truncation / ray.incidence;
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

bool VolumeView::may_see(const BlockCoord& block) const {
  const Eigen::Vector3d centre = centre_in_camera(block);
  const Eigen::Vector3d low = centre - half_extents_, high = centre + half_extents_;
  if (high.z() <= 0.0) return false;
  int left = 0, right = width() - 1, top = 0, bottom = height() - 1;
  // A block about the camera itself may be anywhere in the picture.
  if (low.z() > 0.01 * block_size_) {
    const auto& c = camera_;
    left = std::max(left, first_pixel(low.x(), low.z(), high.z(), c.fx, c.cx));
    right = std::min(right, last_pixel(high.x(), low.z(), high.z(), c.fx, c.cx));
    top = std::max(top, first_pixel(low.y(), low.z(), high.z(), c.fy, c.cy));
    bottom = std::min(bottom, last_pixel(high.y(), low.z(), high.z(), c.fy, c.cy));
    if (left > right || top > bottom) return false;
  }
  for (int row = top / kTile; row <= bottom / kTile; ++row) {
    const auto* tile = tiles_.ptr<float>(row);
    for (int column = left / kTile; column <= right / kTile; ++column) {
      if (low.z() < static_cast<double>(tile[column])) return true;
    }
  }
  return false;
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
  const double pose2 = options_.pose_sigma * options_.pose_sigma, noise = options_.depth_sigma * z * z;
  const double weight = kMaxWeight * pose2 / (pose2 + noise * noise);
  return std::max(1, static_cast<int>(std::lround(weight)));
}

}  // namespace ipl_slam
