#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "evaluation/precision_recall.hpp"

namespace ipl_slam {

struct NamedCurve {
  std::string name;  ///< in the legend; Latin letters only (OpenCV's font)
  std::vector<PrecisionRecallPoint> points;
};

/// Draws precision over recall, both from 0 to 1, with a legend. CV_8UC3, 800 x 700.
[[nodiscard]] cv::Mat draw_precision_recall(const std::vector<NamedCurve>& curves, const std::string& title);

/// Draws and writes an image file, atomically. Throws UserError when it cannot be written.
void write_precision_recall_plot(const std::filesystem::path& file, const std::vector<NamedCurve>& curves,
                                 const std::string& title);

}  // namespace ipl_slam
