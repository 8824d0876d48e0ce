#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "common/random.hpp"
#include "features/line_features.hpp"
#include "map/local_map.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam::test {

/// A straight edge in space, with its brighter side on the right of start -> end as the cameras see it.
struct Edge {
  Eigen::Vector3d start, end;  ///< world, m
  float contrast = 100.0F;     ///< step of the grey value
  Descriptor descriptor{};
};

/// What a camera without distortion sees of a whole edge, exact to the float: end points, inverse depths.
inline LineSegment exact_segment(const Camera& camera, const SE3& T_cw, const Edge& edge) {
  const Eigen::Vector3d start_c = T_cw * edge.start, end_c = T_cw * edge.end;
  LineSegment segment;
  segment.start = camera.project(start_c).cast<float>();
  segment.end = camera.project(end_c).cast<float>();
  segment.start_pixel = camera.distort(camera.project(start_c)).cast<float>();
  segment.end_pixel = camera.distort(camera.project(end_c)).cast<float>();
  segment.contrast = edge.contrast;
  segment.depth.inverse_start = static_cast<float>(1.0 / start_c.z());
  segment.depth.inverse_end = static_cast<float>(1.0 / end_c.z());
  segment.depth.covariance = 1e-6F * Eigen::Matrix2f::Identity();
  return segment;
}

/// How the lines of a keyframe depart from the perfect ones.
struct LineViewOptions {
  double pixel_noise = 0.0;          ///< deviation of each coordinate of an end point, px
  double inverse_depth_noise = 0.0;  ///< deviation at each end, 1/m
  double depth_share = 1.0;          ///< share of the segments that have depth
  double clutter_share = 0.0;        ///< share of the segments that get a descriptor of nothing
};

/// Lines of a keyframe, which edge of the world each of its segments shows, and a frame without keypoints.
struct LineView {
  std::shared_ptr<const Frame> frame;
  std::shared_ptr<const LineFeatures> lines;
  SE3 T_cw;
  std::vector<std::uint32_t> sources;

  /// Segment that shows an edge, or -1.
  [[nodiscard]] int segment_of(std::uint32_t source) const {
    const auto at = std::lower_bound(sources.begin(), sources.end(), source);
    return at != sources.end() && *at == source ? static_cast<int>(at - sources.begin()) : -1;
  }
};

/// Bright rectangles on dark ground, on a grid that reaches beyond the image of a camera at the origin, each
/// turned and tilted at random. They lie 2.2 to 3 m away and 40 pixels apart, so that they stay apart in the
/// image of every camera within 30 cm and 0.3 rad of the origin. The edges run clockwise on the screen. Their
/// descriptors are random: about 128 bits lie between any two.
class LineWorld {
 public:
  static constexpr int kColumns = 7, kRows = 6;
  static constexpr int kGround = 50;  ///< grey value

  explicit LineWorld(const Camera& camera = kTestCamera, std::uint64_t seed = 1)
      : camera_(camera), seed_(seed) {
    Random random(seed);
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        add_rectangle({64.0 + 128.0 * (column - 1), 60.0 + 120.0 * (row - 1)}, random);
      }
    }
  }

  [[nodiscard]] const Edge& edge(std::uint32_t i) const { return edges_[i]; }
  [[nodiscard]] std::size_t size() const { return edges_.size(); }
  [[nodiscard]] const Camera& camera() const { return camera_; }

  /// The lines a camera at T_cw sees: the edges that show from end to end.
  [[nodiscard]] LineView look(const SE3& T_cw, std::size_t index = 0,
                              const LineViewOptions& options = {}) const {
    Random random(hash64(seed_, index));
    LineFeatures lines;
    std::vector<std::uint32_t> sources;
    for (std::uint32_t i = 0; i < edges_.size(); ++i) {
      if (!shows_whole(T_cw, edges_[i])) continue;
      LineSegment segment = exact_segment(camera_, T_cw, edges_[i]);
      const auto noise = [&](double deviation) { return static_cast<float>(deviation * random.normal()); };
      for (Eigen::Vector2f* end : {&segment.start, &segment.end}) {
        for (int k = 0; k < 2; ++k) (*end)[k] += noise(options.pixel_noise);
      }
      segment.depth.inverse_start += noise(options.inverse_depth_noise);
      segment.depth.inverse_end += noise(options.inverse_depth_noise);
      if (!random.chance(options.depth_share)) segment.depth = {};
      lines.segments.push_back(segment);
      const bool clutter = random.chance(options.clutter_share);
      lines.descriptors.push_back(clutter ? random_descriptor(random) : edges_[i].descriptor);
      sources.push_back(i);
    }
    return {SyntheticWorld::make_frame({}, index), std::make_shared<const LineFeatures>(std::move(lines)),
            T_cw, std::move(sources)};
  }

  /// The image a camera at T_cw takes, CV_8UC1. Edges are steps under a Gaussian of 0.7 pixels, which is
  /// about what a lens and the area of a pixel make of them.
  [[nodiscard]] cv::Mat image(const SE3& T_cw) const {
    cv::Mat grey(camera_.height, camera_.width, CV_8UC1, cv::Scalar(kGround));
    for (std::uint32_t first = 0; first < edges_.size(); first += 4) draw_rectangle(T_cw, first, grey);
    return grey;
  }
  /// The depth image that goes with it, CV_16UC1, raw units: known up to 8 pixels from the edges that show
  /// from end to end, where a depth camera sees the rectangle or something right behind it.
  [[nodiscard]] cv::Mat depth(const SE3& T_cw) const {
    cv::Mat depth(camera_.height, camera_.width, CV_16UC1, cv::Scalar(0));
    for (const Edge& edge : edges_) {
      if (!shows_whole(T_cw, edge)) continue;
      const Line3 line_c = T_cw * *Line3::through(edge.start, edge.end);
      const Eigen::Vector2d start = camera_.project(T_cw * edge.start),
                            end = camera_.project(T_cw * edge.end);
      const Eigen::Vector2d along = (end - start).normalized(), across(-along.y(), along.x());
      const double length = (end - start).norm();
      for (double t = 0.0; t <= length; t += 0.5) {
        for (double s = -8.0; s <= 8.0; s += 0.5) {
          const Eigen::Vector2d uv = start + t * along;
          const Eigen::Vector2d pixel = camera_.distort(uv + s * across);
          const int u = static_cast<int>(std::lround(pixel.x())),
                    v = static_cast<int>(std::lround(pixel.y()));
          if (u < 0 || v < 0 || u >= camera_.width || v >= camera_.height) continue;
          depth.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(
              std::lround(camera_.depth_scale / inverse_depth_at(camera_, line_c, uv)));
        }
      }
    }
    return depth;
  }

 private:
  static Descriptor random_descriptor(Random& random) {
    Descriptor descriptor;
    for (auto& word : descriptor) word = random.bits();
    return descriptor;
  }

  void add_rectangle(const Eigen::Vector2d& pixel, Random& random) {
    const double z = random.uniform(2.2, 3.0);
    const Eigen::Vector3d centre = kTestCamera.unproject(pixel, z);
    const double half_width = random.uniform(26.0, 38.0) * z / kTestCamera.fx;
    const double half_height = random.uniform(22.0, 33.0) * z / kTestCamera.fx;
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(random.uniform(-0.3, 0.3), Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(random.uniform(-0.4, 0.4), Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(random.uniform(-0.4, 0.4), Eigen::Vector3d::UnitX());
    const auto contrast = static_cast<float>(random.uniform(60.0, 180.0));
    const auto corner = [&](double x, double y) -> Eigen::Vector3d {
      return centre + turn * Eigen::Vector3d(x * half_width, y * half_height, 0.0);
    };
    // Image axes: x to the right, y down.
    const std::array corners{corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)};
    for (std::size_t i = 0; i < 4; ++i) {
      edges_.push_back({corners[i], corners[(i + 1) % 4], contrast, random_descriptor(random)});
    }
  }

  [[nodiscard]] bool shows_whole(const SE3& T_cw, const Edge& edge) const {
    constexpr double kBorder = 10.0;  // pixels
    for (const Eigen::Vector3d& p_w : {edge.start, edge.end}) {
      const Eigen::Vector3d p_c = T_cw * p_w;
      if (p_c.z() < 0.1) return false;
      const Eigen::Vector2d uv = camera_.distort(camera_.project(p_c));
      if ((uv.array() < kBorder).any() || uv.x() > camera_.width - 1 - kBorder ||
          uv.y() > camera_.height - 1 - kBorder)
        return false;
    }
    return true;
  }

  /// The rectangle whose edges start with `first`. Its four edges, each a step blurred across, multiply.
  void draw_rectangle(const SE3& T_cw, std::uint32_t first, cv::Mat& grey) const {
    std::array<ImageLine, 4> borders;
    Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
    for (std::uint32_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d start_c = T_cw * edges_[first + i].start, end_c = T_cw * edges_[first + i].end;
      if (start_c.z() < 0.1 || end_c.z() < 0.1) return;
      borders[i] = *image_line(camera_.project(start_c), camera_.project(end_c));
      const Eigen::Vector2d uv = camera_.distort(camera_.project(start_c));
      low = low.cwiseMin(uv);
      high = high.cwiseMax(uv);
    }
    constexpr double kMargin = 5.0;  // for the blur, and the bend of an edge between its ends
    const int left = std::max(0, static_cast<int>(low.x() - kMargin)),
              right = std::min(camera_.width - 1, static_cast<int>(high.x() + kMargin)),
              top = std::max(0, static_cast<int>(low.y() - kMargin)),
              bottom = std::min(camera_.height - 1, static_cast<int>(high.y() + kMargin));
    for (int v = top; v <= bottom; ++v) {
      for (int u = left; u <= right; ++u) {
        const Eigen::Vector2d pixel(u, v);
        const Eigen::Vector2d uv = camera_.distorted() ? camera_.undistort(pixel) : pixel;
        double share = 1.0;
        for (const ImageLine& border : borders) share *= blurred_step(signed_distance(border, uv));
        if (share < 1e-3) continue;
        grey.at<std::uint8_t>(v, u) =
            static_cast<std::uint8_t>(std::lround(kGround + share * edges_[first].contrast));
      }
    }
  }

  static double blurred_step(double distance) {
    constexpr double kBlur = 0.7;
    if (std::abs(distance) > 4.0 * kBlur) return distance > 0.0 ? 1.0 : 0.0;
    return 0.5 * (1.0 + std::erf(distance / (kBlur * std::numbers::sqrt2)));
  }

  Camera camera_;
  std::uint64_t seed_;
  std::vector<Edge> edges_;
};

/// A map of a world of lines with perfect landmarks.
class LineWorldMap {
 public:
  explicit LineWorldMap(const LineWorld& world) : world_(world), line_of_(world.size()) {}

  /// Adds a view as a keyframe at its true pose. It observes the edges it shows; those that the map lacks are
  /// made.
  KeyframeId add(const LineView& view) {
    const KeyframeId id = map.add_keyframe(view.frame, view.T_cw, view.lines);
    for (std::uint32_t s = 0; s < view.sources.size(); ++s) {
      LineId& line = line_of_[view.sources[s]];
      const Edge& edge = world_.edge(view.sources[s]);
      if (line.valid()) {
        map.add_observation(line, id, s);
        map.refresh(line);
      } else {
        line = map.add_line(*Line3::through(edge.start, edge.end), edge.start, edge.end, id, s);
      }
    }
    return id;
  }
  [[nodiscard]] LineId line_of(std::uint32_t source) const { return line_of_[source]; }
  [[nodiscard]] std::shared_ptr<const LocalMap> snapshot() const {
    return std::make_shared<const LocalMap>(build_local_map(map, map.newest_keyframe(), {}));
  }

  Map map{kTestPyramid};

 private:
  const LineWorld& world_;
  std::vector<LineId> line_of_;
};

}  // namespace ipl_slam::test
