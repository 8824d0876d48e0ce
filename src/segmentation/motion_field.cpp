#include "segmentation/motion_field.hpp"

#include <algorithm>
#include <cmath>

#include "common/median.hpp"

namespace ipl_slam {
namespace {

cv::Point2f median_shift(const std::vector<PointMove>& moves) {
  std::vector<float> dx, dy;
  for (const PointMove& m : moves) {
    dx.push_back(m.from.x - m.to.x);
    dy.push_back(m.from.y - m.to.y);
  }
  return {median(dx), median(dy)};
}

float length(cv::Point2f v) {
  return std::sqrt(v.dot(v));
}

}  // namespace

MotionField::MotionField(const std::vector<PointMove>& moves, cv::Size size, double reach)
    : size_(size), grid_(size.width / kCell + 2, size.height / kCell + 2) {
  CV_Assert(!moves.empty());
  fit_similarity(moves);
  fit_departures(moves, static_cast<float>(reach));
}

// From the median shift on by reweighted least squares with Cauchy weights (Horn's closed form in 2-D).
void MotionField::fit_similarity(const std::vector<PointMove>& moves) {
  constexpr int kRounds = 5;
  constexpr float kTrackingNoise = 0.5F;  // pixels; finer residuals say nothing
  t_ = median_shift(moves);
  std::vector<float> weights(moves.size());
  for (int round = 0; round < kRounds; ++round) {
    std::vector<float> residuals;
    for (const PointMove& m : moves) residuals.push_back(length(similarity(m.to) - m.from));
    std::vector<float> sorted = residuals;
    const float scale = std::max(kTrackingNoise, 2.0F * median(sorted));
    cv::Point2f mean_to, mean_from;
    float sum = 0.0F;
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const float r = residuals[i] / scale;
      weights[i] = 1.0F / (1.0F + r * r);
      mean_to += weights[i] * moves[i].to;
      mean_from += weights[i] * moves[i].from;
      sum += weights[i];
    }
    mean_to /= sum;
    mean_from /= sum;
    float dot = 0.0F, cross = 0.0F, square = 0.0F;
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const cv::Point2f to = moves[i].to - mean_to, from = moves[i].from - mean_from;
      dot += weights[i] * to.dot(from);
      cross += weights[i] * static_cast<float>(to.cross(from));
      square += weights[i] * to.dot(to);
    }
    if (square <= sum) return;  // all within a pixel: the shift is all there is to know
    a_ = dot / square;
    b_ = cross / square;
    t_ = mean_from - cv::Point2f(a_ * mean_to.x - b_ * mean_to.y, b_ * mean_to.x + a_ * mean_to.y);
  }
}

// Weighted mean of the departures near each node. One point's worth of weight says "none", so that the field
// fades out where no point is near.
void MotionField::fit_departures(const std::vector<PointMove>& moves, float reach) {
  constexpr float kCutOff = 2.5F;  // reaches; beyond it a weight is below 5 %
  const auto nodes = static_cast<std::size_t>(grid_.area());
  departures_.assign(nodes, {0.0F, 0.0F});
  std::vector<float> weights(nodes, 1.0F);
  const float cut_off = kCutOff * reach;
  const auto node_from = [&](float p) { return std::max(0, static_cast<int>((p - cut_off) / kCell)); };
  const auto node_to = [&](float p) { return static_cast<int>((p + cut_off) / kCell); };
  for (const PointMove& m : moves) {
    const cv::Point2f departure = m.from - similarity(m.to);
    for (int r = node_from(m.to.y); r <= std::min(grid_.height - 1, node_to(m.to.y)); ++r) {
      for (int c = node_from(m.to.x); c <= std::min(grid_.width - 1, node_to(m.to.x)); ++c) {
        const cv::Point2f apart =
            m.to - cv::Point2f(static_cast<float>(c * kCell), static_cast<float>(r * kCell));
        const float weight = std::exp(-0.5F * apart.dot(apart) / (reach * reach));
        const auto node = static_cast<std::size_t>(r * grid_.width + c);
        departures_[node] += weight * departure;
        weights[node] += weight;
      }
    }
  }
  for (std::size_t i = 0; i < nodes; ++i) departures_[i] /= weights[i];
}

void MotionField::sources(int first, int last, int y, cv::Point2f* sources) const {
  const cv::Point2f* above = departures_.data() + static_cast<std::ptrdiff_t>(y / kCell) * grid_.width;
  const cv::Point2f* below = above + grid_.width;
  const float down = static_cast<float>(y % kCell) / kCell;
  const auto source_at_node = [&](int c) {
    return similarity({static_cast<float>(c * kCell), static_cast<float>(y)}) + (1.0F - down) * above[c] +
           down * below[c];
  };
  for (int c = first / kCell; c * kCell < last; ++c) {
    const cv::Point2f left = source_at_node(c);
    const cv::Point2f step = (source_at_node(c + 1) - left) / static_cast<float>(kCell);
    const int begin = std::max(first, c * kCell), end = std::min(last, (c + 1) * kCell);
    for (int x = begin; x < end; ++x) *sources++ = left + step * static_cast<float>(x - c * kCell);
  }
}

cv::Rect MotionField::moved(cv::Rect box) const {
  // Corners through the inverse of the similarity; departures shift by as much as the largest of them.
  const float square = std::max(a_ * a_ + b_ * b_, 1e-6F);
  float slack = 1.0F;
  for (const cv::Point2f& departure : departures_) slack = std::max(slack, length(departure));
  slack /= std::sqrt(square);
  float left = 1e9F, right = -1e9F, top = 1e9F, bottom = -1e9F;
  for (const cv::Point corner : {box.tl(), {box.br().x, box.y}, {box.x, box.br().y}, box.br()}) {
    const cv::Point2f p = cv::Point2f(corner) - t_;
    const float x = (a_ * p.x + b_ * p.y) / square, y = (a_ * p.y - b_ * p.x) / square;
    left = std::min(left, x);
    right = std::max(right, x);
    top = std::min(top, y);
    bottom = std::max(bottom, y);
  }
  const auto clip = [](float v, int limit) {
    return static_cast<int>(std::clamp(v, 0.0F, static_cast<float>(limit)));
  };
  return {cv::Point(clip(left - slack, size_.width), clip(top - slack, size_.height)),
          cv::Point(clip(right + slack + 1.0F, size_.width), clip(bottom + slack + 1.0F, size_.height))};
}

}  // namespace ipl_slam
