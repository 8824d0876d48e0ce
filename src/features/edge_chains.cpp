#include "features/edge_chains.hpp"

#include <algorithm>
#include <cstring>

namespace ipl_slam {
namespace {

constexpr int kBucketShift = 6;  // anchors are sorted by strength in steps of half a grey value per pixel
constexpr std::size_t kBuckets = (1U << 15U) >> kBucketShift;

// Peak of the parabola through three values, relative to the middle one, within its pixel.
float peak(float before, float middle, float after) {
  const float curvature = before - 2.0F * middle + after;
  if (curvature >= 0.0F) return 0.0F;
  return std::clamp(0.5F * (before - after) / curvature, -0.5F, 0.5F);
}

EdgePoint edge_point(const EdgeMap& map, std::size_t i) {
  const auto w = static_cast<std::size_t>(map.width);
  const std::vector<std::int16_t>& m = map.magnitude;
  EdgePoint p{static_cast<float>(i % w), static_cast<float>(i / w), static_cast<float>(map.gy[i]),
              static_cast<float>(-map.gx[i])};
  if (map.runs_along_u(i)) {
    p.v += peak(m[i - w], m[i], m[i + w]);
  } else {
    p.u += peak(m[i - 1], m[i], m[i + 1]);
  }
  return p;
}

}  // namespace

// Counting sort: strongest first, equally strong ones in the order of their places.
void EdgeChainFinder::collect_anchors(const EdgeMap& map) {
  unsorted_.clear();
  bucket_ends_.assign(kBuckets + 1, 0);
  const auto bucket = [&](std::size_t i) {
    return kBuckets - 1 - static_cast<std::size_t>(map.magnitude[i] >> kBucketShift);
  };
  const std::size_t size = map.is_ridge.size();
  const auto add = [&](std::size_t i) {
    if (map.is_ridge[i] == 0) return;
    unsorted_.push_back(static_cast<std::uint32_t>(i));
    ++bucket_ends_[bucket(i) + 1];
  };
  std::size_t i = 0;
  for (; i + 8 <= size; i += 8) {  // most groups of eight hold none
    std::uint64_t eight = 0;
    std::memcpy(&eight, map.is_ridge.data() + i, sizeof eight);
    if (eight == 0) continue;
    for (std::size_t k = 0; k < 8; ++k) add(i + k);
  }
  for (; i < size; ++i) add(i);
  for (std::size_t b = 0; b < kBuckets; ++b) bucket_ends_[b + 1] += bucket_ends_[b];
  anchors_.resize(unsorted_.size());
  for (const std::uint32_t a : unsorted_) anchors_[bucket_ends_[bucket(a)]++] = a;
}

// Appends the pixels beyond `from` to path_. direction: 1 = with the brighter side on the right, -1 = against
// it.
void EdgeChainFinder::follow(const EdgeMap& map, std::size_t from, int direction, int min_magnitude) {
  const std::ptrdiff_t w = map.width;
  std::size_t here = from;
  while (true) {
    const int gx = map.gx[here], gy = map.gy[here];
    std::ptrdiff_t ahead = 0, aside = 0;
    if (map.runs_along_u(here)) {
      ahead = gy > 0 ? direction : -direction;
      aside = w;
    } else {
      ahead = (gx > 0 ? -w : w) * direction;
      aside = 1;
    }
    const std::size_t middle = here + static_cast<std::size_t>(ahead);
    std::size_t next = middle;
    for (const std::size_t other :
         {middle - static_cast<std::size_t>(aside), middle + static_cast<std::size_t>(aside)}) {
      if (map.magnitude[other] > map.magnitude[next]) next = other;
    }
    if (map.magnitude[next] < min_magnitude || visited_[next] != 0) return;
    if (gx * map.gx[next] + gy * map.gy[next] <= 0) return;
    visited_[next] = 1;
    path_.push_back(static_cast<std::uint32_t>(next));
    here = next;
  }
}

void EdgeChainFinder::find(const EdgeMap& map, int min_magnitude, std::size_t min_points,
                           EdgeChains& chains) {
  chains.points.clear();
  chains.begins.assign(1, 0);
  visited_.assign(map.magnitude.size(), 0);
  collect_anchors(map);
  min_magnitude = std::max(min_magnitude, 1);  // never onto the border, where it is 0
  for (const std::uint32_t anchor : anchors_) {
    if (visited_[anchor] != 0) continue;
    visited_[anchor] = 1;
    path_.clear();
    follow(map, anchor, -1, min_magnitude);
    std::reverse(path_.begin(), path_.end());
    path_.push_back(anchor);
    follow(map, anchor, 1, min_magnitude);
    if (path_.size() < min_points) continue;
    for (const std::uint32_t i : path_) chains.points.push_back(edge_point(map, i));
    chains.begins.push_back(chains.points.size());
  }
}

}  // namespace ipl_slam
