#include "dense/label_voters.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "common/median.hpp"

namespace ipl_slam {
namespace {

// Every other pixel of every other row is enough for a median.
constexpr int kStride = 2;

float farthest_of(std::vector<float>& depths, float spread) {
  const float middle = median(depths);
  for (float& d : depths) d = std::abs(d - middle);
  return middle + std::max(spread, 3.0F * median(depths));
}

}  // namespace

LabelVoters::LabelVoters(const cv::Mat& labels, const cv::Mat& depth, int margin, double depth_spread)
    : labels_(labels) {
  CV_Assert(depth.type() == CV_32FC1);
  if (labels.empty()) return;
  CV_Assert(labels.type() == CV_8UC1 && labels.size() == depth.size());
  const cv::Mat window = cv::Mat::ones(2 * margin + 1, 2 * margin + 1, CV_8UC1);
  cv::erode(labels, least_, window);
  cv::dilate(labels, greatest_, window);
  find_farthest(depth, depth_spread);
}

void LabelVoters::find_farthest(const cv::Mat& depth, double depth_spread) {
  std::array<std::vector<float>, 256> depths;
  for (int v = 0; v < depth.rows; v += kStride) {
    for (int u = 0; u < depth.cols; u += kStride) {
      const float z = depth.at<float>(v, u);
      const std::uint8_t label = least_.at<std::uint8_t>(v, u);
      if (z > 0.0F && label != 0 && label == greatest_.at<std::uint8_t>(v, u)) depths[label].push_back(z);
    }
  }
  for (std::size_t label = 1; label < depths.size(); ++label) {
    if (!depths[label].empty()) {
      farthest_[label] = farthest_of(depths[label], static_cast<float>(depth_spread));
    }
  }
}

}  // namespace ipl_slam
