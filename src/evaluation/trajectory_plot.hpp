#pragma once

#include <filesystem>
#include <string>

#include <opencv2/core.hpp>

#include "dataset/trajectory.hpp"
#include "evaluation/absolute_error.hpp"

namespace ipl_slam {

struct TrajectoryPlotStyle {
  std::string title;  ///< at the top, e.g. the sequence's name; Latin letters only (OpenCV's font)
  int width = 1200;   ///< of the picture, pixels; at least 600
  int height = 1000;  ///< of the picture, pixels; at least 500
};

/// Draws an estimated trajectory over the ground truth as the TUM benchmark does: both paths in the plane of
/// the two axes they spread most along (metres, same scale on both), red lines between poses that belong
/// together, and below it the error over time. `ate` is the comparison of the two. CV_8UC3.
[[nodiscard]] cv::Mat draw_trajectory(const Trajectory& ground_truth, const Trajectory& estimate,
                                      const AteResult& ate, const TrajectoryPlotStyle& style = {});

/// Draws and writes an image file, atomically. Throws UserError when it cannot be written.
void write_trajectory_plot(const std::filesystem::path& file, const Trajectory& ground_truth,
                           const Trajectory& estimate, const AteResult& ate,
                           const TrajectoryPlotStyle& style = {});

}  // namespace ipl_slam
