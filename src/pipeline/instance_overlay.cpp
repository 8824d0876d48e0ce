#include "pipeline/instance_overlay.hpp"

#include <algorithm>
#include <string>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr double kTint = 0.4;  // share of the state's colour within a mask
constexpr double kFontScale = 0.45;

cv::Scalar color_of(MotionState state) {
  switch (state) {
    case MotionState::kCandidate:
      return {0, 190, 255};
    case MotionState::kStill:
      return {80, 200, 60};
    case MotionState::kMoving:
      return {50, 50, 240};
  }
  return {};
}

void tint(cv::Mat& picture, const cv::Mat& mask, const cv::Scalar& color) {
  const cv::Rect box = cv::boundingRect(mask);
  if (box.empty()) return;
  cv::Mat area = picture(box);
  cv::Mat tinted;
  cv::addWeighted(area, 1.0 - kTint, cv::Mat(area.size(), area.type(), color), kTint, 0.0, tinted);
  tinted.copyTo(area, mask(box));
}

using Outlines = std::vector<std::vector<cv::Point>>;

Outlines outlines_of(const BitMask& mask) {
  Outlines outlines;
  cv::findContours(mask.to_image(), outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  return outlines;
}

// Red and white in turn: seen on any picture.
void draw_dashed(cv::Mat& picture, const Outlines& outlines) {
  constexpr std::size_t kDash = 8;  // pixels
  for (const std::vector<cv::Point>& outline : outlines) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const cv::Scalar color = i / kDash % 2 == 0 ? cv::Scalar(50, 50, 240) : cv::Scalar::all(255);
      cv::line(picture, outline[i], outline[(i + 1) % outline.size()], color, 2);
    }
  }
}

// Dark letters on the state's colour; inside the picture whatever the box.
void label(cv::Mat& picture, const cv::Rect& box, const std::string& words, const cv::Scalar& color) {
  int baseline = 0;
  const cv::Size size = cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, kFontScale, 1, &baseline);
  const int height = size.height + baseline + 2;
  const int x = std::clamp(box.x, 0, std::max(0, picture.cols - size.width - 4));
  const int y = std::clamp(box.y - height, 0, std::max(0, picture.rows - height));
  cv::rectangle(picture, {x, y, size.width + 4, height}, color, cv::FILLED);
  cv::putText(picture, words, {x + 2, y + size.height + 2}, cv::FONT_HERSHEY_SIMPLEX, kFontScale,
              {20, 20, 20}, 1, cv::LINE_AA);
}

}  // namespace

cv::Mat draw_instances(const cv::Mat& image, const std::vector<TrackedInstance>& instances,
                       const std::function<ContourVerdict(InstanceId)>& verdict,
                       const FeatureWeights& weights) {
  cv::Mat picture;
  image.channels() == 1 ? cv::cvtColor(image, picture, cv::COLOR_GRAY2BGR) : image.copyTo(picture);

  // Labels go on top of every mask.
  for (const TrackedInstance& tracked : instances) {
    const cv::Scalar color = color_of(verdict ? verdict(tracked.id).state : MotionState::kCandidate);
    tint(picture, tracked.instance.mask.to_image(), color);
    cv::drawContours(picture, outlines_of(tracked.instance.mask), -1, color, 1, cv::LINE_8);
  }
  if (weights.regions) {
    for (const Region& region : *weights.regions) {
      if (region.verdict.dynamic) draw_dashed(picture, outlines_of(region.mask));
    }
  }
  for (const TrackedInstance& tracked : instances) {
    const Instance& instance = tracked.instance;
    std::string words = fmt::format("{} {:.2f} #{}", instance.class_name, instance.score, tracked.id.value);
    MotionState state = MotionState::kCandidate;
    if (verdict) {
      state = verdict(tracked.id).state;
      words += fmt::format(" {}", to_string(state));
    }
    cv::rectangle(picture, instance.box, color_of(state), 1);
    label(picture, instance.box, words, color_of(state));
  }
  return picture;
}

}  // namespace ipl_slam
