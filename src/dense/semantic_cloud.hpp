#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace ipl_slam {

/// Red, green, blue.
using Rgb = std::array<std::uint8_t, 3>;

/// A surface element, one per voxel at most.
struct CloudPoint {
  static constexpr std::int32_t kUnlabelled = -1;

  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< world, m
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();    ///< unit, out of the surface
  Rgb color{};                                         ///< as the cameras saw it
  std::int32_t label = kUnlabelled;                    ///< of SemanticCloud::classes
  float confidence = 0.0F;                             ///< of the label, 0 to 1; 0 without one

  friend bool operator==(const CloudPoint&, const CloudPoint&) = default;
};

/// A class that points of a cloud have.
struct CloudClass {
  std::int32_t label = 0;
  std::string name;
  Rgb color{};  ///< in the legend

  friend bool operator==(const CloudClass&, const CloudClass&) = default;
};

/// Static surfaces with colours and classes, in the world frame of the map.
struct SemanticCloud {
  std::vector<CloudPoint> points;
  std::vector<CloudClass> classes;  ///< those that occur, by label
};

/// Something with a name that stands in the cloud.
struct CloudObject {
  std::int32_t label = 0;
  std::string class_name;
  float confidence = 0.0F;    ///< mean of its points', 0 to 1
  Eigen::Vector3f low, high;  ///< corners of its box along the world's axes, m
  Eigen::Vector3f centre;     ///< mean of its points, m
  int views = 0;              ///< keyframes in which the segmenter saw it
  std::size_t points = 0;
};

/// The number of a class: its place among COCO's, or 80 and more for other names, in the order they are asked
/// for.
class ClassLabels {
 public:
  [[nodiscard]] std::int32_t label(const std::string& class_name);
  [[nodiscard]] std::string name(std::int32_t label) const;

 private:
  std::vector<std::string> others_;
};

/// A colour for a class that is the same in every cloud, and easily told from those of its neighbours.
[[nodiscard]] Rgb class_color(std::int32_t label);

/// What a cloud shows: its own colours, or the class colours of points that have a class.
enum class CloudColors { kImage, kLabels };

}  // namespace ipl_slam
