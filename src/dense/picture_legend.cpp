#include "dense/picture_legend.hpp"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFontScale = 0.5;
constexpr int kRow = 20, kPatch = 14, kPad = 8, kEdge = 10;  // pixels
constexpr std::size_t kLongest = 24;                         // letters of a name

// OpenCV's fonts hold ASCII only.
std::string printable(std::string name) {
  if (name.size() > kLongest) name.replace(kLongest - 2, std::string::npos, "..");
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return name;
}

}  // namespace

void draw_legend(cv::Mat& picture, const std::vector<CloudClass>& classes) {
  const int room = (picture.rows - 2 * kEdge - 2 * kPad) / kRow;
  if (classes.empty() || room < 2) return;
  const bool all_fit = classes.size() <= static_cast<std::size_t>(room);
  const std::size_t shown = all_fit ? classes.size() : static_cast<std::size_t>(room - 1);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < shown; ++i) names.push_back(printable(classes[i].name));
  if (!all_fit) names.push_back(fmt::format("and {} more", classes.size() - shown));

  int widest = 0;
  for (const std::string& name : names) {
    widest = std::max(widest, cv::getTextSize(name, kFont, kFontScale, 1, nullptr).width);
  }
  const cv::Rect box(kEdge, kEdge, widest + kPatch + 3 * kPad,
                     static_cast<int>(names.size()) * kRow + 2 * kPad);
  cv::rectangle(picture, box, cv::Scalar::all(255), cv::FILLED);
  cv::rectangle(picture, box, cv::Scalar::all(128));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const int x = box.x + kPad, y = box.y + kPad + static_cast<int>(i) * kRow;
    if (i < shown) {
      const Rgb& c = classes[i].color;
      cv::rectangle(picture, {x, y + (kRow - kPatch) / 2, kPatch, kPatch}, cv::Scalar(c[2], c[1], c[0]),
                    cv::FILLED);
    }
    cv::putText(picture, names[i], {x + kPatch + kPad, y + kRow - 6}, kFont, kFontScale, cv::Scalar::all(0),
                1, cv::LINE_AA);
  }
}

}  // namespace ipl_slam
