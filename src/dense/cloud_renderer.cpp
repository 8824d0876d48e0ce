#include "dense/cloud_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "dense/picture_legend.hpp"

namespace ipl_slam {
namespace {

constexpr int kFiner = 2;          // the picture is drawn so many times finer, then averaged: smooth edges
constexpr float kNear = 0.05F;     // m; what is nearer to the eye is not drawn
constexpr float kMostPixels = 64;  // half edge of a point's square: a point before the eye hides not all
constexpr float kTouching =
    1.5F;                        // edge of a point's square per spacing: neighbours on slanted surfaces touch
constexpr int kPasses = 2;       // of closing gaps, each closes one pixel
constexpr int kSurrounded = 6;   // of its 8 neighbours lie before a gap
constexpr float kDeeper = 4.0F;  // spacings that a surface lies behind another to be seen through a gap of it
constexpr float kAmbient = 0.65F;  // brightness of what is turned away from the light
constexpr int kLinePixels = 2;
constexpr float kAtInfinity = std::numeric_limits<float>::infinity();
constexpr std::int32_t kNoPoint = -1;

// The viewpoint at the finer scale, in floats.
class Projection {
 public:
  explicit Projection(const Viewpoint& view)
      : R_(view.T_vw.rotation_matrix().cast<float>()),
        t_(view.T_vw.translation().cast<float>()),
        size_(view.size * kFiner),
        orthographic_(view.orthographic),
        scale_(static_cast<float>(view.scale * kFiner)),
        cx_(0.5F * static_cast<float>(size_.width)),
        cy_(0.5F * static_cast<float>(size_.height)) {}

  [[nodiscard]] cv::Size size() const { return size_; }
  [[nodiscard]] Eigen::Vector3f to_view(const Eigen::Vector3f& p_w) const { return R_ * p_w + t_; }
  [[nodiscard]] Eigen::Vector3f turned(const Eigen::Vector3f& n_w) const { return R_ * n_w; }
  /// Pixels per metre at a depth.
  [[nodiscard]] float scale_at(float depth) const { return orthographic_ ? scale_ : scale_ / depth; }
  /// Place of a point in the picture, (0, 0) its upper left corner.
  [[nodiscard]] Eigen::Vector2f pixel(const Eigen::Vector3f& p_v) const {
    const float s = scale_at(p_v.z());
    return {s * p_v.x() + cx_, s * p_v.y() + cy_};
  }
  /// Depth of a share of the way, in the picture, between two points: where rays meet, its inverse grows
  /// evenly.
  [[nodiscard]] float depth_between(float a, float b, float share) const {
    return orthographic_ ? a + share * (b - a) : 1.0F / ((1.0F - share) / a + share / b);
  }
  [[nodiscard]] bool faces_viewer(const Eigen::Vector3f& n_v, const Eigen::Vector3f& p_v) const {
    return (orthographic_ ? n_v.z() : n_v.dot(p_v)) < 0.0F;
  }

 private:
  Eigen::Matrix3f R_;
  Eigen::Vector3f t_;
  cv::Size size_;
  bool orthographic_;
  float scale_, cx_, cy_;
};

// Which point is seen in each pixel, and how far it is.
struct Buffers {
  cv::Mat depth;  // CV_32FC1, m
  cv::Mat point;  // CV_32SC1, index
};

// First and one behind the last pixel of a stretch about a place, inside the picture; one pixel at least.
std::pair<int, int> stretch(float middle, float half, int size) {
  const float low = std::floor(middle - half + 0.5F),
              high = std::max(std::floor(middle + half + 0.5F), low + 1.0F);
  const auto end = static_cast<float>(size);
  return {static_cast<int>(std::clamp(low, 0.0F, end)), static_cast<int>(std::clamp(high, 0.0F, end))};
}

void draw_points(const SemanticCloud& cloud, const Projection& projection, float edge, bool all_faces,
                 Buffers& out) {
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const CloudPoint& point = cloud.points[i];
    const Eigen::Vector3f p_v = projection.to_view(point.position);
    if (!(p_v.z() > kNear)) continue;
    const bool has_normal = !point.normal.isZero(0.0F);
    if (!all_faces && has_normal && !projection.faces_viewer(projection.turned(point.normal), p_v)) continue;
    const Eigen::Vector2f uv = projection.pixel(p_v);
    if (!uv.allFinite()) continue;
    const float half = std::min(0.5F * edge * projection.scale_at(p_v.z()), kMostPixels);
    const auto [left, right] = stretch(uv.x(), half, projection.size().width);
    const auto [top, bottom] = stretch(uv.y(), half, projection.size().height);
    for (int v = top; v < bottom; ++v) {
      auto* depth = out.depth.ptr<float>(v);
      auto* owner = out.point.ptr<std::int32_t>(v);
      for (int u = left; u < right; ++u) {
        if (p_v.z() < depth[u]) {
          depth[u] = p_v.z();
          owner[u] = static_cast<std::int32_t>(i);
        }
      }
    }
  }
}

// A pixel that shows what lies far behind most of its neighbours is a gap between points of one surface: it
// takes the one of these neighbours whose depth is in the middle.
void close_gaps(Buffers& buffers, float deeper) {
  const Buffers before{buffers.depth.clone(), buffers.point.clone()};
  for (int v = 1; v < buffers.depth.rows - 1; ++v) {
    const std::array<const float*, 3> rows{before.depth.ptr<float>(v - 1), before.depth.ptr<float>(v),
                                           before.depth.ptr<float>(v + 1)};
    for (int u = 1; u < buffers.depth.cols - 1; ++u) {
      const float limit = rows[1][u] - deeper;  // stays infinite
      std::array<std::pair<float, int>, 9> front;
      int count = 0;
      for (int k = 0; k < 9; ++k) {
        const float depth = rows[static_cast<std::size_t>(k / 3)][u + k % 3 - 1];
        if (depth < limit) front[static_cast<std::size_t>(count++)] = {depth, k};
      }
      if (count < kSurrounded) continue;
      std::nth_element(front.begin(), front.begin() + count / 2, front.begin() + count);
      const auto [depth, k] = front[static_cast<std::size_t>(count / 2)];
      buffers.depth.at<float>(v, u) = depth;
      buffers.point.at<std::int32_t>(v, u) = before.point.at<std::int32_t>(v + k / 3 - 1, u + k % 3 - 1);
    }
  }
}

using Color = Eigen::Vector3f;  // red, green, blue, 0 to 255

Color as_color(const Rgb& c) {
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

Color grey_of(const Rgb& c) {
  return Color::Constant(as_color(c).dot(Eigen::Vector3f(0.299F, 0.587F, 0.114F)));  // luma, ITU-R BT.601
}

// Dark to light, told apart also by those who do not see all colours.
class Ramp {
 public:
  Ramp() {
    cv::Mat values(1, 256, CV_8UC1);
    for (int i = 0; i < 256; ++i) values.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i);
    cv::applyColorMap(values, colors_, cv::COLORMAP_VIRIDIS);
  }
  [[nodiscard]] Color at(float share) const {
    const auto& c = colors_.at<cv::Vec3b>(static_cast<int>(255.0F * std::clamp(share, 0.0F, 1.0F)));
    return {static_cast<float>(c[2]), static_cast<float>(c[1]), static_cast<float>(c[0])};
  }

 private:
  cv::Mat colors_;
};

// The colour of a point, before light falls on it.
class Paint {
 public:
  Paint(const SemanticCloud& cloud, const Upright& upright, PictureColors colors)
      : colors_(colors), R_uw_(upright.T_uw.rotation_matrix().cast<float>()) {
    for (const CloudClass& c : cloud.classes) classes_[c.label] = c.color;
    if (colors == PictureColors::kHeight) find_heights(cloud);
  }

  [[nodiscard]] Color operator()(const CloudPoint& point) const {
    const bool has_class = point.label != CloudPoint::kUnlabelled;
    switch (colors_) {
      case PictureColors::kLabels:
        return has_class ? as_color(class_color_of(point.label)) : grey_of(point.color);
      case PictureColors::kNormals:
        return 127.5F * ((R_uw_ * point.normal).array() + 1.0F);
      case PictureColors::kHeight:
        return ramp_.at((height(point) - low_) / (high_ - low_));
      case PictureColors::kConfidence:
        return has_class ? ramp_.at(point.confidence) : grey_of(point.color);
      case PictureColors::kImage:
        break;
    }
    return as_color(point.color);
  }
  [[nodiscard]] Rgb class_color_of(std::int32_t label) const {
    const auto known = classes_.find(label);
    return known != classes_.end() ? known->second : class_color(label);
  }

 private:
  [[nodiscard]] float height(const CloudPoint& point) const { return R_uw_.row(2).dot(point.position); }

  void find_heights(const SemanticCloud& cloud) {
    constexpr double kStrays = 0.01;  // share of the points at either end that share the end's colour
    if (cloud.points.empty()) return;
    std::vector<float> heights;
    for (const CloudPoint& point : cloud.points) heights.push_back(height(point));
    const auto out = static_cast<std::ptrdiff_t>(kStrays * static_cast<double>(heights.size()));
    std::nth_element(heights.begin(), heights.begin() + out, heights.end());
    low_ = heights[static_cast<std::size_t>(out)];
    std::nth_element(heights.begin(), heights.end() - 1 - out, heights.end());
    high_ = std::max(*(heights.end() - 1 - out), low_ + 1e-3F);
  }

  PictureColors colors_;
  Eigen::Matrix3f R_uw_;
  std::map<std::int32_t, Rgb> classes_;
  Ramp ramp_;
  float low_ = 0.0F, high_ = 1.0F;
};

// A lamp above the viewer's left shoulder, that lights what is turned to it.
float brightness(const Eigen::Vector3f& n_v) {
  static const Eigen::Vector3f to_light = Eigen::Vector3f(-0.35F, -0.5F, -0.8F).normalized();
  if (n_v.isZero(0.0F)) return 1.0F;
  return kAmbient + (1.0F - kAmbient) * std::max(n_v.dot(to_light), 0.0F);
}

cv::Vec3b as_pixel(const Color& color) {
  const auto channel = [](float c) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(c, 0.0F, 255.0F)));
  };
  return {channel(color.z()), channel(color.y()), channel(color.x())};
}

cv::Mat color_pixels(const SemanticCloud& cloud, const Projection& projection, const Paint& paint,
                     const PictureStyle& style, const cv::Mat& point_of) {
  const bool shaded = style.shading && style.colors != PictureColors::kNormals;
  cv::Mat picture(point_of.size(), CV_8UC3,
                  cv::Scalar(style.background[2], style.background[1], style.background[0]));
  for (int v = 0; v < picture.rows; ++v) {
    const auto* owner = point_of.ptr<std::int32_t>(v);
    auto* pixel = picture.ptr<cv::Vec3b>(v);
    for (int u = 0; u < picture.cols; ++u) {
      if (owner[u] == kNoPoint) continue;
      const CloudPoint& point = cloud.points[static_cast<std::size_t>(owner[u])];
      const float light = shaded ? brightness(projection.turned(point.normal)) : 1.0F;
      pixel[u] = as_pixel(light * paint(point));
    }
  }
  return picture;
}

// The part of a segment before the eye; nothing where there is none.
std::optional<std::pair<Eigen::Vector3f, Eigen::Vector3f>> before_eye(Eigen::Vector3f a, Eigen::Vector3f b) {
  if (a.z() < kNear && b.z() < kNear) return std::nullopt;
  const auto cut = [](const Eigen::Vector3f& in, const Eigen::Vector3f& out) -> Eigen::Vector3f {
    return in + (kNear - in.z()) / (out.z() - in.z()) * (out - in);
  };
  if (a.z() < kNear)
    a = cut(b, a);
  else if (b.z() < kNear)
    b = cut(a, b);
  return std::pair(a, b);
}

// A segment as dots a pixel apart, where no surface lies before them by more than `slack` (m).
void draw_segment(const Projection& projection, const cv::Mat& depth, const Eigen::Vector3f& a,
                  const Eigen::Vector3f& b, float slack, const cv::Vec3b& color, cv::Mat& picture) {
  constexpr float kMostDots = 20000;  // of a segment that leads far out of the picture
  constexpr float kHalf = 0.5F * kFiner * kLinePixels;
  const Eigen::Vector2f from = projection.pixel(a), to = projection.pixel(b);
  const float length = (to - from).norm();
  if (!std::isfinite(length)) return;
  const int dots = static_cast<int>(std::min(length, kMostDots)) + 1;
  for (int i = 0; i <= dots; ++i) {
    const float s = static_cast<float>(i) / static_cast<float>(dots);
    const Eigen::Vector2f uv = from + s * (to - from);
    const float z = projection.depth_between(a.z(), b.z(), s) - slack;
    const auto [left, right] = stretch(uv.x(), kHalf, picture.cols);
    const auto [top, bottom] = stretch(uv.y(), kHalf, picture.rows);
    for (int v = top; v < bottom; ++v) {
      for (int u = left; u < right; ++u) {
        if (z < depth.at<float>(v, u)) picture.at<cv::Vec3b>(v, u) = color;
      }
    }
  }
}

void draw_line(const Projection& projection, const PictureLine& line, const cv::Mat& depth, float slack,
               cv::Mat& picture) {
  for (std::size_t i = 1; i < line.points.size(); ++i) {
    const auto part = before_eye(projection.to_view(line.points[i - 1].cast<float>()),
                                 projection.to_view(line.points[i].cast<float>()));
    if (part)
      draw_segment(projection, depth, part->first, part->second, slack, as_pixel(as_color(line.color)),
                   picture);
  }
}

// The classes that the picture shows, those of most pixels first.
std::vector<CloudClass> visible_classes(const SemanticCloud& cloud, const cv::Mat& point_of) {
  std::map<std::int32_t, std::size_t> pixels;
  for (auto it = point_of.begin<std::int32_t>(); it != point_of.end<std::int32_t>(); ++it) {
    if (*it != kNoPoint) ++pixels[cloud.points[static_cast<std::size_t>(*it)].label];
  }
  std::vector<CloudClass> classes;
  for (const CloudClass& c : cloud.classes) {
    if (pixels.contains(c.label)) classes.push_back(c);
  }
  std::stable_sort(classes.begin(), classes.end(), [&](const CloudClass& a, const CloudClass& b) {
    return pixels[a.label] > pixels[b.label];
  });
  return classes;
}

}  // namespace

PictureLine path_line(const Trajectory& trajectory, const Rgb& color) {
  PictureLine line{{}, color};
  for (const StampedPose& pose : trajectory) line.points.push_back(pose.T_wc.translation());
  return line;
}

PictureLine camera_line(const SE3& T_wc, double depth, const Rgb& color) {
  constexpr double kWide = 0.6, kHigh = 0.45;  // half sides at a depth of 1: those of a Kinect
  const auto at = [&](double x, double y, double z) { return T_wc * (depth * Eigen::Vector3d(x, y, z)); };
  const auto eye = at(0, 0, 0), a = at(-kWide, -kHigh, 1), b = at(kWide, -kHigh, 1), c = at(kWide, kHigh, 1),
             d = at(-kWide, kHigh, 1);
  return {{eye, a, b, eye, c, d, eye, d, a, b, c}, color};
}

double point_spacing(const SemanticCloud& cloud) {
  constexpr std::size_t kSamples = 64;
  constexpr double kShare = 0.75;         // of the samples have nearer neighbours
  constexpr std::size_t kNeighbours = 4;  // so many has a point of a square lattice at its spacing
  std::vector<float> distances;
  const std::size_t step = std::max<std::size_t>(cloud.points.size() / kSamples, 1);
  for (std::size_t i = 0; i < cloud.points.size(); i += step) {
    std::array<float, kNeighbours> nearest;  // sorted
    nearest.fill(kAtInfinity);
    for (const CloudPoint& other : cloud.points) {
      const float d = (other.position - cloud.points[i].position).squaredNorm();
      if (!(d > 0.0F && d < nearest.back())) continue;
      nearest.back() = d;
      for (std::size_t k = kNeighbours - 1; k > 0 && nearest[k] < nearest[k - 1]; --k)
        std::swap(nearest[k], nearest[k - 1]);
    }
    // The farthest there is, where a cloud has fewer.
    const auto last = std::find_if(nearest.rbegin(), nearest.rend(), [](float d) { return d < kAtInfinity; });
    if (last != nearest.rend()) distances.push_back(*last);
  }
  if (distances.empty()) return 0.0;
  const auto place = static_cast<std::ptrdiff_t>(kShare * static_cast<double>(distances.size() - 1));
  std::nth_element(distances.begin(), distances.begin() + place, distances.end());
  return std::sqrt(static_cast<double>(distances[static_cast<std::size_t>(place)]));
}

cv::Mat draw_cloud(const SemanticCloud& cloud, const Viewpoint& view, const Upright& upright,
                   const std::vector<PictureLine>& lines, const PictureStyle& style) {
  CV_Assert(view.size.width > 0 && view.size.height > 0);
  const Projection projection(view);
  const auto spacing = static_cast<float>(point_spacing(cloud));
  const float edge = style.point_size > 0.0 ? static_cast<float>(style.point_size) : kTouching * spacing;
  Buffers buffers{cv::Mat(projection.size(), CV_32FC1, cv::Scalar(kAtInfinity)),
                  cv::Mat(projection.size(), CV_32SC1, cv::Scalar(kNoPoint))};
  draw_points(cloud, projection, edge, style.all_faces, buffers);
  for (int pass = 0; pass < kPasses; ++pass) close_gaps(buffers, kDeeper * spacing);

  const Paint paint(cloud, upright, style.colors);
  cv::Mat fine = color_pixels(cloud, projection, paint, style, buffers.point);
  for (const PictureLine& line : lines) draw_line(projection, line, buffers.depth, edge, fine);
  cv::Mat picture;
  cv::resize(fine, picture, view.size, 0.0, 0.0, cv::INTER_AREA);
  if (style.colors == PictureColors::kLabels) draw_legend(picture, visible_classes(cloud, buffers.point));
  return picture;
}

}  // namespace ipl_slam
