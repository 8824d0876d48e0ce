#include "dynamics/carried_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "common/median.hpp"

namespace ipl_slam {
namespace {

constexpr int kDepthSamples = 1000;  // enough for a median

// Distance of grid points at which a mask of this area has at most `samples` of them.
int stride_for(int area, int samples) {
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(area) / samples))));
}

// Calls visit(x, y) for the mask's pixels on a grid.
template <class Visit>
void for_each_sample(const BitMask& mask, const cv::Rect& box, int stride, Visit visit) {
  for (int y = box.y + stride / 2; y < box.y + box.height; y += stride) {
    for (int x = box.x + stride / 2; x < box.x + box.width; x += stride) {
      if (mask.test(x, y)) visit(x, y);
    }
  }
}

double median_inverse_depth(const BitMask& mask, const InstanceView::Shape& shape, const cv::Mat& depth,
                            double depth_scale) {
  std::vector<std::uint16_t> measured;
  for_each_sample(mask, shape.box, stride_for(shape.area, kDepthSamples), [&](int x, int y) {
    if (const auto raw = depth.at<std::uint16_t>(y, x); raw != 0) measured.push_back(raw);
  });
  if (measured.empty()) return 0.0;
  return depth_scale / median(measured);
}

void add_point(Moments<double>& m, double x, double y, double weight) {
  const double wx = weight * x, wy = weight * y;
  m.m00 += weight;
  m.m10 += wx;
  m.m01 += wy;
  m.m20 += wx * x;
  m.m11 += wx * y;
  m.m02 += wy * y;
  m.m30 += wx * x * x;
  m.m21 += wx * x * y;
  m.m12 += wx * y * y;
  m.m03 += wy * y * y;
}

}  // namespace

InstanceView::InstanceView(std::vector<TrackedInstance> instances_seen, cv::Mat depth_image,
                           std::optional<SE3> pose, double scale)
    : instances(std::move(instances_seen)), depth(std::move(depth_image)), T_wc(pose), depth_scale(scale) {
  for (const TrackedInstance& tracked : instances) {
    const BitMask& mask = tracked.instance.mask;
    CV_Assert(depth.type() == CV_16UC1 && mask.size() == depth.size());
    Shape shape{mask.bounding_box(), mask.area(), 0.0};
    shape.inverse_depth = median_inverse_depth(mask, shape, depth, depth_scale);
    shapes.push_back(shape);
  }
}

double InstanceView::inverse_depth(int x, int y) const {
  if (const auto raw = depth.at<std::uint16_t>(y, x); raw != 0) return depth_scale / raw;
  double nearest = 0.0;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (instances[i].instance.mask.test(x, y)) nearest = std::max(nearest, shapes[i].inverse_depth);
  }
  return nearest;
}

bool InstanceView::another_instance(std::size_t i, int x, int y) const {
  for (std::size_t k = 0; k < instances.size(); ++k) {
    if (k != i && instances[k].instance.mask.test(x, y)) return true;
  }
  return false;
}

// Areas in pixels of the view in which the shape is described.
struct CarriedComparison::CarriedMask {
  double area = 0.0;        // of all that was carried
  double visible = 0.0;     // of what the other frame could show
  double compared = 0.0;    // the same, what is only noise of the outline having less weight
  double common = 0.0;      // of what it does show
  Moments<double> moments;  // of what it could show
};

CarriedComparison::CarriedComparison(const Camera& camera, const CarriedComparisonOptions& options)
    : camera_(camera), options_(options) {
  rays_.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d uv = camera.undistort({x, y});
      rays_.emplace_back(static_cast<float>((uv.x() - camera.cx) / camera.fx),
                         static_cast<float>((uv.y() - camera.cy) / camera.fy));
    }
  }
}

CarriedComparison::CarriedMask CarriedComparison::carry(const InstanceView& from, std::size_t i,
                                                        const InstanceView& to, std::size_t j,
                                                        Place described, cv::Point origin) const {
  const SE3 T_to_from = to.T_wc->inverse() * *from.T_wc;
  const Eigen::Matrix3d R = T_to_from.rotation_matrix();
  const Eigen::Vector3d t = T_to_from.translation();
  const BitMask& mask = from.instances[i].instance.mask;
  const BitMask& other = to.instances[j].instance.mask;
  const double own_inverse_depth = from.shapes[i].inverse_depth;
  const double filled_depth = own_inverse_depth > 0.0 ? 1.0 / own_inverse_depth : options_.unmeasured_depth;
  const int stride = stride_for(from.shapes[i].area, options_.samples);

  CarriedMask result;
  for_each_sample(mask, from.shapes[i].box, stride, [&](int x, int y) {
    const auto raw = from.depth.at<std::uint16_t>(y, x);
    const double z = raw != 0 ? raw / from.depth_scale : filled_depth;
    const auto& ray = rays_[static_cast<std::size_t>(y * camera_.width + x)];
    const Eigen::Vector3d p = R * Eigen::Vector3d(ray.x() * z, ray.y() * z, z) + t;
    const double zoom = p.z() > 0.0 ? z / p.z() : 1.0;  // a piece of surface looks larger by this from there
    const double area = stride * stride * (described == Place::carried ? zoom * zoom : 1.0);
    result.area += area;
    if (p.z() <= 0.0) return;
    Eigen::Vector2d uv = camera_.project(p);
    if (camera_.distorted()) uv = camera_.distort(uv);
    if (!(uv.x() > -0.5 && uv.y() > -0.5 && uv.x() < camera_.width - 0.5 && uv.y() < camera_.height - 0.5))
      return;
    const int u = static_cast<int>(std::lround(uv.x())), v = static_cast<int>(std::lround(uv.y()));

    const bool in_other = other.test(u, v);
    const double seen = to.inverse_depth(u, v);
    const double nearer_by = seen - 1.0 / p.z();  // 1/m, how much nearer what is seen there is
    // Covered by something nearer, or by another instance that is not clearly behind.
    const double covers_from = to.another_instance(j, u, v) ? -options_.depth_gap : options_.depth_gap;
    if (!in_other && nearer_by > covers_from) return;
    const bool measured = raw != 0 && seen != 0.0;
    const bool same_surface = measured && std::abs(nearer_by) <= options_.depth_gap;
    // Outside the other mask, but still in its place: rather the outline's noise than motion.
    const double weight = !in_other && same_surface ? area * options_.outline_weight : area;
    result.visible += area;
    result.compared += weight;
    if (in_other && (same_surface || !measured || !options_.surface_agreement)) result.common += weight;
    const bool carried = described == Place::carried;
    add_point(result.moments, (carried ? uv.x() : x) - origin.x, (carried ? uv.y() : y) - origin.y, area);
  });
  return result;
}

std::optional<ShapeComparison> CarriedComparison::compare(const InstanceView& earlier, std::size_t a,
                                                          const InstanceView& later, std::size_t b) const {
  if (!earlier.T_wc || !later.T_wc || earlier.shapes[a].area == 0 || later.shapes[b].area == 0)
    return std::nullopt;
  CV_Assert(later.depth.cols == camera_.width && later.depth.rows == camera_.height);
  const cv::Point centre = (later.shapes[b].box.tl() + later.shapes[b].box.br()) / 2;
  const CarriedMask before = carry(earlier, a, later, b, Place::carried, centre);
  const CarriedMask now = carry(later, b, earlier, a, Place::own, centre);
  for (const CarriedMask& mask : {before, now}) {
    if (mask.visible < options_.minimum_visible * mask.area || mask.compared <= 0.0) return std::nullopt;
  }
  // Both directions measure the common area; each alone knows what only its own mask holds.
  const double common = 0.5 * (before.common + now.common);
  const double either = common + (before.compared - before.common) + (now.compared - now.common);
  return ShapeComparison{common / either, hu_invariants(before.moments), hu_invariants(now.moments)};
}

}  // namespace ipl_slam
