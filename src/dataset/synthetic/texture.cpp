#include "dataset/synthetic/texture.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#ifdef __SSE4_1__
#include <smmintrin.h>
#endif

namespace ipl_slam::synthetic {
namespace {

#ifdef __SSE4_1__
Color unpack(std::uint32_t texel) {
  Color result;
  _mm_store_ps(result.data(), _mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(static_cast<int>(texel)))));
  return result;
}
#else
Color unpack(std::uint32_t texel) {
  return {static_cast<float>(texel & 0xff), static_cast<float>((texel >> 8) & 0xff),
          static_cast<float>((texel >> 16) & 0xff), 0.0F};
}
#endif

// Logarithm to base 2 of a number of at least 1, by straight lines between powers of two: good to 0.09, which
// is plenty to choose a sharpness, and the same on every machine.
float log2_roughly(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  const auto exponent = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  return exponent + std::bit_cast<float>((bits & 0x7fffffU) | 0x3f800000U) - 1.0F;
}

// Mean of four packed texels, rounded, channel by channel.
std::uint32_t mean_of(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  std::uint32_t result = 0;
  for (int shift = 0; shift < 24; shift += 8) {
    const std::uint32_t sum =
        ((a >> shift) & 0xff) + ((b >> shift) & 0xff) + ((c >> shift) & 0xff) + ((d >> shift) & 0xff);
    result |= ((sum + 2) / 4) << shift;
  }
  return result;
}

}  // namespace

Texture::Texture(const cv::Mat& image) {
  CV_Assert(image.type() == CV_8UC3);
  CV_Assert((image.cols & (image.cols - 1)) == 0 && (image.rows & (image.rows - 1)) == 0);
  Level base{image.cols, image.rows, {}};
  base.texels.reserve(image.total());
  for (int y = 0; y < image.rows; ++y) {
    const auto* row = image.ptr<cv::Vec3b>(y);
    for (int x = 0; x < image.cols; ++x) {
      base.texels.push_back(row[x][0] | (std::uint32_t{row[x][1]} << 8) | (std::uint32_t{row[x][2]} << 16));
    }
  }
  levels_.push_back(std::move(base));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level half{std::max(1, fine.width / 2), std::max(1, fine.height / 2), {}};
    half.texels.reserve(static_cast<std::size_t>(half.width) * half.height);
    const int step_x = fine.width / half.width;
    const int step_y = fine.height / half.height;
    for (int y = 0; y < half.height; ++y) {
      const std::uint32_t* top = fine.texels.data() + static_cast<std::size_t>(y) * step_y * fine.width;
      const std::uint32_t* bottom = top + static_cast<std::size_t>(step_y - 1) * fine.width;
      for (int x = 0; x < half.width; ++x) {
        const int left = x * step_x;
        const int right = left + step_x - 1;
        half.texels.push_back(mean_of(top[left], top[right], bottom[left], bottom[right]));
      }
    }
    levels_.push_back(std::move(half));
  }
}

Color Texture::bilinear(const Level& level, float x, float y) {
  x -= 0.5F;  // texel centres lie at half numbers
  y -= 0.5F;
  const float floor_x = std::floor(x);
  const float floor_y = std::floor(y);
  const float fx = x - floor_x;
  const float fy = y - floor_y;
  const int x0 = static_cast<int>(floor_x) & (level.width - 1);
  const int y0 = static_cast<int>(floor_y) & (level.height - 1);
  const int x1 = (x0 + 1) & (level.width - 1);
  const int y1 = (y0 + 1) & (level.height - 1);
  const std::uint32_t* top = level.texels.data() + static_cast<std::size_t>(y0) * level.width;
  const std::uint32_t* bottom = level.texels.data() + static_cast<std::size_t>(y1) * level.width;
  return (unpack(top[x0]) * (1.0F - fx) + unpack(top[x1]) * fx) * (1.0F - fy) +
         (unpack(bottom[x0]) * (1.0F - fx) + unpack(bottom[x1]) * fx) * fy;
}

Color Texture::sample(float x, float y, float footprint) const {
  if (footprint <= 1.0F) return bilinear(levels_.front(), x, y);
  const float lod = std::min(log2_roughly(footprint), static_cast<float>(levels_.size() - 1));
  const auto fine = std::min(static_cast<std::size_t>(lod), levels_.size() - 1);
  const std::size_t coarse = std::min(fine + 1, levels_.size() - 1);
  const float weight = lod - static_cast<float>(fine);
  const float scale = 1.0F / static_cast<float>(1U << fine);
  const float coarse_scale = 1.0F / static_cast<float>(1U << coarse);
  return bilinear(levels_[fine], x * scale, y * scale) * (1.0F - weight) +
         bilinear(levels_[coarse], x * coarse_scale, y * coarse_scale) * weight;
}

}  // namespace ipl_slam::synthetic
