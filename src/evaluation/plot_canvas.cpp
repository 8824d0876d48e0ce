#include "evaluation/plot_canvas.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr double kOversampling = 3.0;
constexpr int kSubpixelBits = 4;  // fractional bits of coordinates handed to OpenCV
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFontCapHeight = 21.0;  // of kFont at scale 1, pixels
constexpr double kStrokePerHeight = 0.13;

cv::Point subpixel(cv::Point2d p) {
  const double scale = kOversampling * (1 << kSubpixelBits);
  return {static_cast<int>(std::lround(p.x * scale)), static_cast<int>(std::lround(p.y * scale))};
}

int stroke(double thickness) {
  return std::max(1, static_cast<int>(std::lround(thickness * kOversampling)));
}

double font_scale(double height) {
  return height * kOversampling / kFontCapHeight;
}

cv::Size text_size(const std::string& words, double height) {
  int baseline = 0;
  return cv::getTextSize(words, kFont, font_scale(height), stroke(kStrokePerHeight * height), &baseline);
}

void put_text(cv::Mat& image, const std::string& words, cv::Point corner, double height,
              const cv::Scalar& color) {
  cv::putText(image, words, corner, kFont, font_scale(height), color, stroke(kStrokePerHeight * height),
              cv::LINE_AA);
}

}  // namespace

Ticks ticks_between(double low, double high, double count) {
  const double rough = (high - low) / std::max(count, 1.0);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double step = power * (rough <= power         ? 1.0
                               : rough <= 2.0 * power ? 2.0
                               : rough <= 5.0 * power ? 5.0
                                                      : 10.0);
  Ticks ticks;
  ticks.decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  const double slack = 1e-9 * step;  // a tick that lies on an end by rounding alone belongs to it
  for (double k = std::ceil((low - slack) / step); k * step <= high + slack; ++k) {
    ticks.values.push_back(k == 0.0 ? 0.0 : k * step);  // no "-0"
  }
  return ticks;
}

PlotCanvas::PlotCanvas(int width, int height)
    : large_(cvRound(height * kOversampling), cvRound(width * kOversampling), CV_8UC3, cv::Scalar::all(255)) {
}

void PlotCanvas::line(cv::Point2d a, cv::Point2d b, const cv::Scalar& color, double thickness) {
  cv::line(large_, subpixel(a), subpixel(b), color, stroke(thickness), cv::LINE_AA, kSubpixelBits);
}

void PlotCanvas::dashed_line(cv::Point2d a, cv::Point2d b, const cv::Scalar& color, double thickness) {
  constexpr double dash = 7.0, gap = 5.0;
  const double length = cv::norm(b - a);
  for (double at = 0.0; at < length; at += dash + gap) {
    const double end = std::min(at + dash, length);
    line(a + (b - a) * (at / length), a + (b - a) * (end / length), color, thickness);
  }
}

void PlotCanvas::polyline(const std::vector<cv::Point2d>& points, const cv::Scalar& color, double thickness) {
  for (std::size_t i = 1; i < points.size(); ++i) line(points[i - 1], points[i], color, thickness);
}

void PlotCanvas::polygon(const std::vector<cv::Point2d>& points, const cv::Scalar& color) {
  std::vector<cv::Point> corners;
  for (const cv::Point2d& point : points) corners.push_back(subpixel(point));
  cv::fillPoly(large_, std::vector<std::vector<cv::Point>>{corners}, color, cv::LINE_AA, kSubpixelBits);
}

void PlotCanvas::disc(cv::Point2d center, double radius, const cv::Scalar& color) {
  const int r = static_cast<int>(std::lround(radius * kOversampling * (1 << kSubpixelBits)));
  cv::circle(large_, subpixel(center), r, color, cv::FILLED, cv::LINE_AA, kSubpixelBits);
}

void PlotCanvas::rectangle(const cv::Rect2d& box, const cv::Scalar& color, double thickness) {
  const cv::Point2d a = box.tl(), c = box.br();
  polyline({a, {c.x, a.y}, c, {a.x, c.y}, a}, color, thickness);
}

void PlotCanvas::fill(const cv::Rect2d& box, const cv::Scalar& color) {
  const cv::Point2d a = box.tl(), c = box.br();
  polygon({a, {c.x, a.y}, c, {a.x, c.y}}, color);
}

void PlotCanvas::text(const std::string& words, cv::Point2d at, double height, const cv::Scalar& color,
                      Anchor anchor) {
  const double width = text_size(words, height).width;
  const double shift = anchor == Anchor::kLeft ? 0.0 : anchor == Anchor::kCenter ? 0.5 : 1.0;
  put_text(large_, words,
           {cvRound(at.x * kOversampling - shift * width), cvRound((at.y + 0.5 * height) * kOversampling)},
           height, color);
}

void PlotCanvas::upward_text(const std::string& words, cv::Point2d at, double height,
                             const cv::Scalar& color) {
  const int margin = cvRound(height * kOversampling);  // room for descenders and strokes
  const cv::Size size = text_size(words, height) + cv::Size(2 * margin, 2 * margin);
  cv::Mat flat(size, CV_8UC3, cv::Scalar::all(255));
  put_text(flat, words, {margin, size.height - margin}, height, color);
  cv::Mat turned;
  cv::rotate(flat, turned, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect place(cvRound(at.x * kOversampling) - turned.cols / 2,
                       cvRound(at.y * kOversampling) - turned.rows / 2, turned.cols, turned.rows);
  const cv::Rect visible = place & cv::Rect({0, 0}, large_.size());
  if (visible.empty()) return;
  turned(visible - place.tl()).copyTo(large_(visible));
}

double PlotCanvas::text_width(const std::string& words, double height) {
  return text_size(words, height).width / kOversampling;
}

cv::Mat PlotCanvas::picture() const {
  cv::Mat small;
  cv::resize(large_, small, {}, 1.0 / kOversampling, 1.0 / kOversampling, cv::INTER_AREA);
  return small;
}

}  // namespace ipl_slam
