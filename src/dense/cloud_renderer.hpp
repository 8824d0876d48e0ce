#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "dense/semantic_cloud.hpp"
#include "dense/viewpoint.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// What the colours of a picture mean.
enum class PictureColors {
  kImage,       ///< as the cameras saw it
  kLabels,      ///< class colours, with a legend; what has no class is grey
  kNormals,     ///< directions: x, y, z of the normal in the upright frame as red, green, blue
  kHeight,      ///< over the floor, dark (low) to light
  kConfidence,  ///< of the label, dark (0) to light (1); what has no class is grey
};

/// How a cloud is drawn.
struct PictureStyle {
  PictureColors colors = PictureColors::kImage;
  Rgb background{255, 255, 255};
  double point_size = 0.0;  ///< m; 0 = such that neighbours touch
  bool all_faces =
      false;            ///< draw also what faces away from the viewer, as walls and ceiling seen from outside
  bool shading = true;  ///< surfaces are darker the more they are turned away from the viewer
};

/// A line in space, drawn where no surface is before it.
struct PictureLine {
  std::vector<Eigen::Vector3d> points;  ///< world, m
  Rgb color{};
};

/// The path of cameras.
[[nodiscard]] PictureLine path_line(const Trajectory& trajectory, const Rgb& color);
/// The edges of a camera's pyramid of view, so many metres deep.
[[nodiscard]] PictureLine camera_line(const SE3& T_wc, double depth, const Rgb& color);

/// How far apart neighbouring points lie, m; 0 for fewer than two.
[[nodiscard]] double point_spacing(const SemanticCloud& cloud);

/// A picture of a cloud, drawn without a graphics card: points as squares of their size, the nearest wins
/// (z-buffer), small gaps between them are closed. The same input gives the same bytes. CV_8UC3 (BGR).
[[nodiscard]] cv::Mat draw_cloud(const SemanticCloud& cloud, const Viewpoint& view, const Upright& upright,
                                 const std::vector<PictureLine>& lines, const PictureStyle& style);

}  // namespace ipl_slam
