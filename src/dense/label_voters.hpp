#pragma once

#include <array>
#include <cstdint>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// Which pixels of a view say what is there. Masks bleed: their outlines are a few pixels off, and a chair's
/// mask holds what is seen through its back.
class LabelVoters {
 public:
  /// What a pixel says.
  enum class Says : std::uint8_t { kNothing, kNobody, kInstance };

  /// labels: CV_8UC1, 0 = nobody; may be empty: nobody anywhere. depth: CV_32FC1, m, 0 = none, of the same
  /// size. margin: pixels within it of another label say nothing. depth_spread: nor do those that lie further
  /// behind the instance's median depth, m, than this, or than three median absolute deviations.
  LabelVoters(const cv::Mat& labels, const cv::Mat& depth, int margin, double depth_spread);

  [[nodiscard]] Says says(int u, int v, float depth) const {
    if (labels_.empty()) return Says::kNobody;
    const std::uint8_t label = least_.at<std::uint8_t>(v, u);
    if (label != greatest_.at<std::uint8_t>(v, u)) return Says::kNothing;
    if (label == 0) return Says::kNobody;
    return depth > farthest_[label] ? Says::kNothing : Says::kInstance;
  }
  /// The label of a pixel that says who is there.
  [[nodiscard]] std::uint8_t label(int u, int v) const { return least_.at<std::uint8_t>(v, u); }

 private:
  void find_farthest(const cv::Mat& depth, double depth_spread);

  cv::Mat labels_;
  cv::Mat least_, greatest_;  // label within the margin
  std::array<float, 256> farthest_{};
};

}  // namespace ipl_slam
