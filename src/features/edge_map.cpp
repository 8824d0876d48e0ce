#include "features/edge_map.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <stdexcept>

namespace ipl_slam {
namespace {

constexpr int kMinSide = 3;
constexpr int kReach = 2;  // of the smoothing kernel

// The loops over a row are plain code that the compiler vectorises: a second body for AVX2 saves a tenth of a
// millisecond of a 640x480 image, which is not worth having it.

void smooth_row(const std::array<const std::uint8_t*, 5>& in, int width, std::int16_t* __restrict line,
                std::int16_t* __restrict out) {
  for (int x = 0; x < width; ++x) {
    line[x] = static_cast<std::int16_t>(in[0][x] + in[4][x] + 4 * (in[1][x] + in[3][x]) + 6 * in[2][x]);
  }
  for (int k = 1; k <= kReach; ++k) line[-k] = line[0], line[width - 1 + k] = line[width - 1];
  for (int x = 0; x < width; ++x) {  // 16 bits hold the sum unsigned: at most 255 * 256
    const auto sum =
        static_cast<std::uint16_t>(line[x - 2] + line[x + 2] + 4 * (line[x - 1] + line[x + 1]) + 6 * line[x]);
    out[x] = static_cast<std::int16_t>(sum >> 4);
  }
}

void gradient_row(const std::array<const std::int16_t*, 3>& b, int width, std::int16_t* __restrict gx,
                  std::int16_t* __restrict gy, std::int16_t* __restrict magnitude) {
  for (int x = 1; x < width - 1; ++x) {
    const auto h = static_cast<std::int16_t>((b[0][x + 1] - b[0][x - 1]) + 2 * (b[1][x + 1] - b[1][x - 1]) +
                                             (b[2][x + 1] - b[2][x - 1]));
    const auto v = static_cast<std::int16_t>((b[2][x - 1] - b[0][x - 1]) + 2 * (b[2][x] - b[0][x]) +
                                             (b[2][x + 1] - b[0][x + 1]));
    gx[x] = h;
    gy[x] = v;
    magnitude[x] = static_cast<std::int16_t>(std::abs(h) + std::abs(v));
  }
}

void ridge_row(const std::int16_t* gx, const std::int16_t* gy, const std::int16_t* magnitude, int width,
               std::int16_t min_magnitude, std::uint8_t* __restrict is_ridge) {
  const std::int16_t *m = magnitude, *above = magnitude - width, *below = magnitude + width;
  for (int x = 1; x < width - 1; ++x) {
    // Masks, not conditions: the compiler does not vectorise loads it might have to skip.
    const int along_u = -static_cast<int>(std::abs(gy[x]) >= std::abs(gx[x]));
    const int before = (above[x] & along_u) | (m[x - 1] & ~along_u);
    const int after = (below[x] & along_u) | (m[x + 1] & ~along_u);
    is_ridge[x] =
        static_cast<std::uint8_t>(static_cast<int>(m[x] >= min_magnitude) & static_cast<int>(m[x] > before) &
                                  static_cast<int>(m[x] >= after));
  }
}

// Only the inside is ever written, the border stays 0.
void set_size(EdgeMap& map, int width, int height) {
  if (map.width == width && map.height == height) return;
  map.width = width;
  map.height = height;
  const auto size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  map.gx.assign(size, 0);
  map.gy.assign(size, 0);
  map.magnitude.assign(size, 0);
  map.is_ridge.assign(size, 0);
}

}  // namespace

void compute_edge_map(const cv::Mat& grey, int min_magnitude, EdgeMap& map) {
  if (grey.type() != CV_8UC1 || std::min(grey.cols, grey.rows) < kMinSide) {
    throw std::invalid_argument("compute_edge_map: an 8-bit grey image of at least 3x3 pixels is needed");
  }
  set_size(map, grey.cols, grey.rows);
  const int width = map.width, height = map.height;
  const auto threshold =
      static_cast<std::int16_t>(std::clamp<int>(min_magnitude, 1, std::numeric_limits<std::int16_t>::max()));
  const auto w = static_cast<std::size_t>(width);
  std::vector<std::int16_t> buffer(w + 2 * kReach), smooth(3 * w);
  const auto row = [&](int y) { return smooth.data() + static_cast<std::size_t>(y % 3) * w; };
  const auto at = [&](auto& plane, int y) { return plane.data() + static_cast<std::size_t>(y) * w; };
  for (int y = 0; y < height; ++y) {
    std::array<const std::uint8_t*, 5> in{};
    for (int k = 0; k < 5; ++k) {
      in[static_cast<std::size_t>(k)] = grey.ptr(std::clamp(y + k - kReach, 0, height - 1));
    }
    smooth_row(in, width, buffer.data() + kReach, row(y));
    if (y < 2) continue;
    gradient_row({row(y - 2), row(y - 1), row(y)}, width, at(map.gx, y - 1), at(map.gy, y - 1),
                 at(map.magnitude, y - 1));
    if (y < 3) continue;
    ridge_row(at(map.gx, y - 2), at(map.gy, y - 2), at(map.magnitude, y - 2), width, threshold,
              at(map.is_ridge, y - 2));
  }
  ridge_row(at(map.gx, height - 2), at(map.gy, height - 2), at(map.magnitude, height - 2), width, threshold,
            at(map.is_ridge, height - 2));
}

}  // namespace ipl_slam
