#include "segmentation/letterbox.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr float kPadding = 114.0F;  // the grey that Ultralytics trains with
constexpr float kInverseWhite = 1.0F / 255.0F;

/// Half of the space left over, an odd pixel going to the right: round(d / 2 - 0.1) in LetterBox.
int half(int space) {
  return space / 2;
}

/// One channel of 8-bit pixels `step` bytes apart.
void write_row(const std::uint8_t* pixels, int step, int count, float* out) {
  for (int i = 0; i < count; ++i) out[i] = static_cast<float>(pixels[i * step]) * kInverseWhite;
}

}  // namespace

Letterbox::Letterbox(cv::Size image_size, cv::Size input_size, double max_scale)
    : image(image_size), input(input_size) {
  CV_Assert(image.width > 0 && image.height > 0 && input.width > 0 && input.height > 0);
  const double scale = std::min({static_cast<double>(input.width) / image.width,
                                 static_cast<double>(input.height) / image.height, max_scale});
  content.width = std::max(1, static_cast<int>(std::nearbyint(image.width * scale)));
  content.height = std::max(1, static_cast<int>(std::nearbyint(image.height * scale)));
  content.x = half(input.width - content.width);
  content.y = half(input.height - content.height);
  scale_x = static_cast<double>(content.width) / image.width;
  scale_y = static_cast<double>(content.height) / image.height;
}

void fill_letterbox(const cv::Mat& image, const Letterbox& letterbox, std::vector<float>& planes) {
  CV_Assert(image.size() == letterbox.image && (image.type() == CV_8UC3 || image.type() == CV_8UC1));
  cv::Mat scaled = image;
  const cv::Rect content = letterbox.content;
  if (content.size() != image.size()) cv::resize(image, scaled, content.size(), 0, 0, cv::INTER_LINEAR);

  const auto width = static_cast<std::size_t>(letterbox.input.width);
  const auto area = width * static_cast<std::size_t>(letterbox.input.height);
  planes.assign(3 * area, kPadding * kInverseWhite);
  const int step = scaled.channels();
  for (int y = 0; y < content.height; ++y) {
    const auto* pixels = scaled.ptr<std::uint8_t>(y);
    float* row = planes.data() + static_cast<std::size_t>(content.y + y) * width + content.x;
    for (int plane = 0; plane < 3; ++plane) {
      const int channel = step == 3 ? 2 - plane : 0;  // BGR to RGB
      write_row(pixels + channel, step, content.width, row + static_cast<std::size_t>(plane) * area);
    }
  }
}

}  // namespace ipl_slam
