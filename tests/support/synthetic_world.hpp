#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "common/random.hpp"
#include "features/frame.hpp"
#include "features/scale_pyramid.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam::test {

inline const Camera kTestCamera{.fx = 525.0, .fy = 525.0, .cx = 319.5, .cy = 239.5};
inline const ScalePyramid kTestPyramid{8, 1.2};
inline const DepthNoiseOptions kTestNoise{.inverse_depth_sigma = 0.01, .max_depth = 10.0};

/// T_cw of a camera at `position` (world, m) that is turned by these angles (rad) from looking along world z.
inline SE3 camera_at(const Eigen::Vector3d& position, double pan = 0.0, double roll = 0.0) {
  const Eigen::Quaterniond q_wc =
      Eigen::AngleAxisd(pan, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ());
  return SE3(q_wc, position).inverse();
}

/// |T_a T_b^-1|: metres and radians in one number, for tolerances.
inline double pose_difference(const SE3& T_a, const SE3& T_b) {
  return (T_a * T_b.inverse()).log().norm();
}

/// How a frame departs from the perfect image of the world.
struct ViewOptions {
  double pixel_noise = 0.0;          ///< deviation on level 0, px
  double inverse_depth_noise = 0.0;  ///< deviation, 1/m
  double depth_share = 1.0;          ///< share of the keypoints that have depth
  int flipped_bits = 0;              ///< of every descriptor
  double clutter_share = 0.0;        ///< share of the keypoints that get a descriptor of nothing
};

/// A frame, and which world point each of its keypoints shows.
struct View {
  std::shared_ptr<const Frame> frame;
  SE3 T_cw;
  std::vector<std::uint32_t> sources;

  /// Keypoint that shows a world point, or -1.
  [[nodiscard]] int keypoint_of(std::uint32_t source) const {
    const auto at = std::lower_bound(sources.begin(), sources.end(), source);
    return at != sources.end() && *at == source ? static_cast<int>(at - sources.begin()) : -1;
  }
};

/// Points scattered in a room with random descriptors: about 128 bits lie between any two, so a match that
/// geometry and descriptor allow is the right one. A point shows on the pyramid level that its size and
/// distance ask for, turned as the camera is rolled.
class SyntheticWorld {
 public:
  explicit SyntheticWorld(std::uint64_t seed = 1, int points = 1500,
                          const Eigen::Vector3d& low = {-3.5, -2.0, 1.5},
                          const Eigen::Vector3d& high = {3.5, 2.0, 4.5})
      : seed_(seed) {
    Random random(seed);
    for (int i = 0; i < points; ++i) {
      Thing thing;
      for (int k = 0; k < 3; ++k) thing.position[k] = random.uniform(low[k], high[k]);
      for (auto& word : thing.descriptor) word = random.bits();
      const double turn = random.uniform(0.0, 2.0 * std::numbers::pi);
      thing.edge = {std::cos(turn), std::sin(turn), 0.0};
      // Level 0 from there on: well within the pyramid's range from all places the tests look from.
      thing.range = random.uniform(4.0, 7.0);
      things_.push_back(thing);
    }
  }

  [[nodiscard]] const Eigen::Vector3d& position(std::uint32_t i) const { return things_[i].position; }
  [[nodiscard]] const Descriptor& descriptor(std::uint32_t i) const { return things_[i].descriptor; }
  [[nodiscard]] std::size_t size() const { return things_.size(); }

  /// The frame a camera at T_cw takes; 30 frames per second.
  [[nodiscard]] View look(const SE3& T_cw, std::size_t index = 0, const ViewOptions& options = {}) const {
    Random random(hash64(seed_, index));
    Features features;
    std::vector<std::uint32_t> sources;
    for (std::uint32_t i = 0; i < things_.size(); ++i) {
      const Thing& thing = things_[i];
      const Eigen::Vector3d p_c = T_cw * thing.position;
      if (p_c.z() < 0.3) continue;
      Eigen::Vector2d uv = kTestCamera.project(p_c);
      if ((uv.array() < 0.0).any() || uv.x() > kTestCamera.width - 1 || uv.y() > kTestCamera.height - 1)
        continue;
      const Eigen::Vector2d edge = kTestCamera.project(T_cw * (thing.position + 0.01 * thing.edge)) - uv;
      Keypoint keypoint;
      keypoint.level = level_of(thing.range, p_c.norm());
      const double noise = options.pixel_noise * kTestPyramid.scale(keypoint.level);
      uv += noise * Eigen::Vector2d(random.normal(), random.normal());
      keypoint.pixel = keypoint.undistorted = uv.cast<float>();
      const double angle = std::atan2(edge.y(), edge.x());
      keypoint.angle = static_cast<float>(angle < 0.0 ? angle + 2.0 * std::numbers::pi : angle);
      const double inverse_depth = 1.0 / p_c.z() + options.inverse_depth_noise * random.normal();
      keypoint.depth = random.chance(options.depth_share) ? static_cast<float>(1.0 / inverse_depth) : 0.0F;
      Descriptor descriptor = thing.descriptor;
      for (int b = 0; b < options.flipped_bits; ++b) {
        const std::uint64_t bit = random.index(256);
        descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
      }
      if (random.chance(options.clutter_share)) {
        for (auto& word : descriptor) word = random.bits();
      }
      features.keypoints.push_back(keypoint);
      features.descriptors.push_back(descriptor);
      sources.push_back(i);
    }
    return {make_frame(std::move(features), index), T_cw, std::move(sources)};
  }

  [[nodiscard]] static std::shared_ptr<const Frame> make_frame(Features features, std::size_t index = 0) {
    FeatureGrid grid(features);
    return std::make_shared<const Frame>(
        Frame{index, static_cast<double>(index) / 30.0, std::move(features), std::move(grid)});
  }

 private:
  struct Thing {
    Eigen::Vector3d position, edge;
    Descriptor descriptor;
    double range = 0.0;
  };

  static int level_of(double range, double distance) {
    const double level = std::log(range / distance) / std::log(kTestPyramid.scale(1));
    return std::clamp(static_cast<int>(std::lround(level)), 0, kTestPyramid.levels() - 1);
  }

  std::uint64_t seed_;
  std::vector<Thing> things_;
};

}  // namespace ipl_slam::test
