#include "segmentation/edge_aware_filter.hpp"

namespace ipl_slam {

namespace {

void filter_rows(cv::Mat& image, const cv::Mat& to_right) {
  const int channels = image.channels();
  for (int y = 0; y < image.rows; ++y) {
    auto* row = image.ptr<float>(y);
    const auto* a = to_right.ptr<float>(y);
    for (int x = 1; x < image.cols; ++x) {
      for (int c = 0; c < channels; ++c) {
        float& value = row[x * channels + c];
        value += a[x - 1] * (row[(x - 1) * channels + c] - value);
      }
    }
    for (int x = image.cols - 2; x >= 0; --x) {
      for (int c = 0; c < channels; ++c) {
        float& value = row[x * channels + c];
        value += a[x] * (row[(x + 1) * channels + c] - value);
      }
    }
  }
}

// Blends row y with another one; row by row, so that it is the same for all columns at once.
void blend_row(cv::Mat& image, int y, int other, const float* a) {
  const int channels = image.channels();
  auto* row = image.ptr<float>(y);
  const auto* from = image.ptr<float>(other);
  for (int x = 0; x < image.cols; ++x) {
    for (int c = 0; c < channels; ++c) {
      float& value = row[x * channels + c];
      value += a[x] * (from[x * channels + c] - value);
    }
  }
}

}  // namespace

void filter_along_surfaces(cv::Mat& image, const Conductance& conductance, int passes) {
  for (int pass = 0; pass < passes; ++pass) {
    filter_rows(image, conductance.to_right);
    for (int y = 1; y < image.rows; ++y) blend_row(image, y, y - 1, conductance.to_below.ptr<float>(y - 1));
    for (int y = image.rows - 2; y >= 0; --y) blend_row(image, y, y + 1, conductance.to_below.ptr<float>(y));
  }
}

}  // namespace ipl_slam
