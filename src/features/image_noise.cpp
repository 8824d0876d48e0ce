#include "features/image_noise.hpp"

#include <algorithm>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

// Keeps these draws apart from those of other stages under the same seed.
constexpr std::uint64_t kStream = 0x6e6f6973;  // "nois"

}  // namespace

cv::Mat ImageNoise::add(const cv::Mat& grey, std::size_t frame) const {
  if (deviation_ == 0.0 || grey.type() != CV_8UC1) return grey;
  const std::uint64_t of_frame = hash64(hash64(seed_, kStream), frame);
  const auto deviation = static_cast<float>(deviation_);
  cv::Mat noisy(grey.size(), CV_8UC1);
  std::uint64_t pixel = 0;
  for (int v = 0; v < grey.rows; ++v) {
    const auto* in = grey.ptr<std::uint8_t>(v);
    auto* out = noisy.ptr<std::uint8_t>(v);
    for (int u = 0; u < grey.cols; ++u) {
      const float value = in[u] + deviation * fast_normal_from_bits(hash64(of_frame, pixel++));
      out[u] = static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
    }
  }
  return noisy;
}

}  // namespace ipl_slam
