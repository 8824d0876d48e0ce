#pragma once

#include <string>
#include <string_view>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// Packs a label image (CV_8UC1) without loss: row by row the runs of equal labels, each as label and length
/// less 1, both as numbers of a NibbleWriter.
[[nodiscard]] std::string pack_labels(const cv::Mat& labels);

/// Gives back the image. Throws FormatError for bytes that pack_labels did not make of an image of that size.
[[nodiscard]] cv::Mat unpack_labels(std::string_view bytes, cv::Size size);

}  // namespace ipl_slam
