#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// Values first..last in steps of 1, 2 or 5 times a power of ten, with enough decimals to tell them apart.
struct Ticks {
  std::vector<double> values;
  int decimals = 0;
};

/// Ticks inside [low, high], about `count` of them. Needs low < high.
[[nodiscard]] Ticks ticks_between(double low, double high, double count);

/// A white picture to draw plots on, in pixels of the finished picture. It is drawn larger and scaled down at
/// the end, which gives OpenCV's stroke font and thin lines smooth edges.
class PlotCanvas {
 public:
  enum class Anchor { kLeft, kCenter, kRight };

  PlotCanvas(int width, int height);

  void line(cv::Point2d a, cv::Point2d b, const cv::Scalar& color, double thickness);
  void dashed_line(cv::Point2d a, cv::Point2d b, const cv::Scalar& color, double thickness);
  void polyline(const std::vector<cv::Point2d>& points, const cv::Scalar& color, double thickness);
  void polygon(const std::vector<cv::Point2d>& points, const cv::Scalar& color);
  void disc(cv::Point2d center, double radius, const cv::Scalar& color);
  void rectangle(const cv::Rect2d& box, const cv::Scalar& color, double thickness);
  void fill(const cv::Rect2d& box, const cv::Scalar& color);
  /// Text whose middle line is at `at`; `height` is that of a capital letter.
  void text(const std::string& words, cv::Point2d at, double height, const cv::Scalar& color,
            Anchor anchor = Anchor::kLeft);
  /// The same, turned to read upwards, centred on `at`.
  void upward_text(const std::string& words, cv::Point2d at, double height, const cv::Scalar& color);
  [[nodiscard]] static double text_width(const std::string& words, double height);

  /// The finished picture, CV_8UC3.
  [[nodiscard]] cv::Mat picture() const;

 private:
  cv::Mat large_;
};

}  // namespace ipl_slam
