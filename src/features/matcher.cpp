#include "features/matcher.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "features/hamming.hpp"

namespace ipl_slam {
namespace {

constexpr int kNoDistance = std::numeric_limits<int>::max();
constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;

// Difference of two angles, in [0, pi].
float angle_between(float a, float b) {
  const float d = std::fabs(std::remainder(a - b, kTurn));
  return std::min(d, kTurn - d);
}

bool passes_ratio(int best, int second, double ratio) {
  return ratio >= 1.0 || second == kNoDistance || best < ratio * second;
}

struct Choice {
  int index = -1;
  int distance = kNoDistance;
};

// The keypoint that fits one projected point, before other points are considered.
class PointSearch {
 public:
  PointSearch(const Features& features, const ProjectedPoint& point, const MatchOptions& options)
      : features_(features), point_(point), options_(options) {}

  void consider(int index) {
    const Keypoint& k = features_.keypoints[static_cast<std::size_t>(index)];
    if (!orientation_agrees(k) || !depth_agrees(k)) return;
    const int distance =
        hamming_distance(*point_.descriptor, features_.descriptors[static_cast<std::size_t>(index)]);
    // Ties go to the lower index, so that the order of visits does not matter.
    if (distance < best_.distance || (distance == best_.distance && index < best_.index)) {
      second_ = best_.distance;
      second_level_ = best_level_;
      best_ = {index, distance};
      best_level_ = k.level;
    } else if (distance < second_ || (distance == second_ && k.level == best_level_)) {
      second_ = distance;
      second_level_ = k.level;
    }
  }

  [[nodiscard]] Choice choice() const {
    if (best_.index < 0 || best_.distance > options_.max_distance) return {};
    if (second_level_ == best_level_ && !passes_ratio(best_.distance, second_, options_.ratio)) return {};
    return best_;
  }

 private:
  [[nodiscard]] bool orientation_agrees(const Keypoint& k) const {
    return options_.max_rotation <= 0.0 || point_.angle < 0.0F ||
           angle_between(k.angle, point_.angle) <= options_.max_rotation;
  }
  [[nodiscard]] bool depth_agrees(const Keypoint& k) const {
    return options_.inverse_depth_gate <= 0.0 || point_.depth <= 0.0F || k.depth <= 0.0F ||
           std::fabs(1.0F / k.depth - 1.0F / point_.depth) <= options_.inverse_depth_gate;
  }

  const Features& features_;
  const ProjectedPoint& point_;
  const MatchOptions& options_;
  Choice best_;
  int best_level_ = -1;
  int second_ = kNoDistance;
  int second_level_ = -2;
};

// Drops pairs that turn otherwise than most. The mode is found in a ring of bins, each counted with its
// neighbours, and refined to the circular mean of what fell there.
void keep_common_turn(const Features& a, const Features& b, double max_rotation,
                      std::vector<std::pair<int, int>>& pairs) {
  constexpr int kBins = 36;
  const auto turn = [&](const std::pair<int, int>& p) {
    const float d = b.keypoints[static_cast<std::size_t>(p.second)].angle -
                    a.keypoints[static_cast<std::size_t>(p.first)].angle;
    return d < 0.0F ? d + kTurn : d;
  };
  const auto bin = [](float t) { return static_cast<int>(t / kTurn * kBins) % kBins; };
  int count[kBins] = {};
  for (const auto& p : pairs) ++count[bin(turn(p))];
  int mode = 0;
  int most = 0;
  for (int i = 0; i < kBins; ++i) {
    const int sum = count[(i + kBins - 1) % kBins] + count[i] + count[(i + 1) % kBins];
    if (sum > most) {
      most = sum;
      mode = i;
    }
  }
  double x = 0.0, y = 0.0;
  for (const auto& p : pairs) {
    const int off = (bin(turn(p)) - mode + kBins) % kBins;
    if (off != 0 && off != 1 && off != kBins - 1) continue;
    x += std::cos(turn(p));
    y += std::sin(turn(p));
  }
  const auto center = static_cast<float>(std::atan2(y, x));
  std::erase_if(pairs, [&](const auto& p) { return angle_between(turn(p), center) > max_rotation; });
}

}  // namespace

std::vector<int> match_projected(const Features& features, const FeatureGrid& grid,
                                 std::span<const ProjectedPoint> points, const MatchOptions& options,
                                 std::span<const std::uint8_t> taken) {
  if (!taken.empty() && taken.size() != features.size()) {
    throw std::invalid_argument("match_projected: one entry of `taken` per keypoint is needed");
  }
  std::vector<int> matches(points.size(), -1);
  std::vector<Choice> owners(features.size());  // per keypoint: the point that has it, and how closely
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ProjectedPoint& p = points[i];
    PointSearch search(features, p, options);
    grid.for_each_in_radius(p.uv.x(), p.uv.y(), p.radius, p.min_level, p.max_level, [&](int k) {
      if (taken.empty() || taken[static_cast<std::size_t>(k)] == 0) search.consider(k);
    });
    const Choice choice = search.choice();
    if (choice.index < 0) continue;
    Choice& owner = owners[static_cast<std::size_t>(choice.index)];
    if (choice.distance >= owner.distance) continue;
    if (owner.index >= 0) matches[static_cast<std::size_t>(owner.index)] = -1;
    owner = {static_cast<int>(i), choice.distance};
    matches[i] = choice.index;
  }
  return matches;
}

std::vector<std::pair<int, int>> match_brute_force(const Features& a, const Features& b,
                                                   const MatchOptions& options, Simd simd) {
  const TwoNearest near = two_nearest(a.descriptors, b.descriptors, simd);
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t i = 0; i < a.size() && b.size() > 0; ++i) {
    const Nearest& forth = near.in_b[i];
    const auto j = static_cast<std::size_t>(forth.index);
    const Nearest& back = near.in_a[j];
    if (back.index != static_cast<int>(i) || forth.distance > options.max_distance) continue;
    if (!passes_ratio(forth.distance, forth.second_distance, options.ratio)) continue;
    if (!passes_ratio(back.distance, back.second_distance, options.ratio)) continue;
    pairs.emplace_back(static_cast<int>(i), forth.index);
  }
  if (options.max_rotation > 0.0) keep_common_turn(a, b, options.max_rotation, pairs);
  return pairs;
}

}  // namespace ipl_slam
