#include "features/chain_splitter.hpp"

#include <cmath>
#include <numbers>

namespace ipl_slam {
namespace {

constexpr double kRefitGrowth = 1.2;  // a line is fitted anew when it has grown by this factor

// Least squares across the line, from sums over the points relative to an origin near them.
class LineFit {
 public:
  explicit LineFit(const Eigen::Vector2d& origin) : origin_(origin) {}

  void add(const EdgePoint& p) {
    const double x = p.u - origin_.x(), y = p.v - origin_.y();
    n_ += 1.0;
    x_ += x;
    y_ += y;
    xx_ += x * x;
    xy_ += x * y;
    yy_ += y * y;
  }
  [[nodiscard]] double count() const { return n_; }

  // Larger eigenvector of the scatter matrix, in the sense of `rough`.
  void solve(const EdgePoint& rough) {
    const double mx = x_ / n_, my = y_ / n_;
    const double cxx = xx_ / n_ - mx * mx, cyy = yy_ / n_ - my * my, cxy = xy_ / n_ - mx * my;
    const double half = 0.5 * (cxx - cyy), root = std::sqrt(half * half + cxy * cxy);
    direction_ = half >= 0.0 ? Eigen::Vector2d(half + root, cxy) : Eigen::Vector2d(cxy, root - half);
    direction_.normalize();
    if (direction_.x() * rough.du + direction_.y() * rough.dv < 0.0) direction_ = -direction_;
    point_ = origin_ + Eigen::Vector2d(mx, my);
  }

  [[nodiscard]] double deviation(const EdgePoint& p) const {
    return std::abs(direction_.x() * (p.v - point_.y()) - direction_.y() * (p.u - point_.x()));
  }
  [[nodiscard]] bool runs_like(const EdgePoint& p, double min_cosine) const {
    const double along = direction_.x() * p.du + direction_.y() * p.dv;
    return along > 0.0 && along * along >= min_cosine * min_cosine * (p.du * p.du + p.dv * p.dv);
  }
  [[nodiscard]] Eigen::Vector2d foot(const EdgePoint& p) const {
    return point_ + direction_ * direction_.dot(Eigen::Vector2d(p.u, p.v) - point_);
  }

 private:
  Eigen::Vector2d origin_;
  double n_ = 0.0, x_ = 0.0, y_ = 0.0, xx_ = 0.0, xy_ = 0.0, yy_ = 0.0;
  Eigen::Vector2d point_ = Eigen::Vector2d::Zero(), direction_ = Eigen::Vector2d::UnitX();
};

}  // namespace

void split_chain(std::span<const EdgePoint> chain, double pixel, const ChainSplitterOptions& options,
                 std::vector<StraightPiece>& pieces) {
  const double max_deviation = pixel * options.max_deviation;
  const double min_cosine = std::cos(options.max_direction_error * std::numbers::pi / 180.0);
  const auto seed = static_cast<std::size_t>(options.seed_points);
  const auto agrees = [&](const LineFit& line, const EdgePoint& p) {
    return line.deviation(p) <= max_deviation && line.runs_like(p, min_cosine);
  };
  const auto seed_at = [&](std::size_t begin) {
    LineFit line({chain[begin].u, chain[begin].v});
    for (std::size_t i = begin; i < begin + seed; ++i) line.add(chain[i]);
    line.solve(chain[begin + seed / 2]);
    return line;
  };
  std::size_t begin = 0;
  while (begin + seed <= chain.size()) {
    LineFit line = seed_at(begin);
    std::size_t end = begin;  // past the last point that agrees
    while (end < begin + seed && agrees(line, chain[end])) ++end;
    if (end < begin + seed) {
      ++begin;
      continue;
    }
    double fitted = line.count();
    for (std::size_t i = end; i < chain.size() && i < end + 1 + static_cast<std::size_t>(options.max_misses);
         ++i) {
      if (!agrees(line, chain[i])) continue;
      line.add(chain[i]);
      end = i + 1;
      if (line.count() >= kRefitGrowth * fitted) {
        line.solve(chain[i]);
        fitted = line.count();
      }
    }
    line.solve(chain[begin + seed / 2]);
    pieces.push_back({line.foot(chain[begin]), line.foot(chain[end - 1])});
    begin = end;
  }
}

}  // namespace ipl_slam
