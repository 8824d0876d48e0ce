#pragma once

#include <opencv2/core.hpp>

#include "dataset/synthetic/scene.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam::synthetic {

/// What a perfect camera sees.
struct RenderedImages {
  cv::Mat color;      ///< CV_32FC3, BGR, 0..255
  cv::Mat depth;      ///< CV_32FC1, metres along the optical axis, 0 where nothing is hit
  cv::Mat incidence;  ///< CV_32FC1, cosine between the viewing ray and the surface normal
  cv::Mat label;      ///< CV_8UC1, SceneObject::id, 0 for structure
};

/// Casts one ray per pixel; pixels on outlines get several for their colour, so that edges are smooth, while
/// depth and label stay those of the pixel's centre. The result does not depend on the number of threads (0 =
/// one per core). The camera's distortion is not applied.
void render(const Scene& scene, const Camera& camera, const SE3& T_wc, double time, unsigned threads,
            RenderedImages& images);

}  // namespace ipl_slam::synthetic
