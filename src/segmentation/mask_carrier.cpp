#include "segmentation/mask_carrier.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "common/median.hpp"
#include "segmentation/motion_field.hpp"

namespace ipl_slam {
namespace {

constexpr int kLevels = 3;  // of the flow's pyramid above the halved image; small images have fewer
constexpr int kCoarse = 8;  // pixels per pixel of the coarse image

/// Raw depth of an instance: centre, and how far from it the instance extends.
struct DepthRange {
  int centre = 0, spread = 0;
  [[nodiscard]] bool known() const { return centre > 0; }
  [[nodiscard]] bool holds(int raw) const { return std::abs(raw - centre) <= spread; }
};

int depth_at(const cv::Mat& depth, int x, int y) {
  return depth.at<std::uint16_t>(y, x);
}

DepthRange depth_range(const BitMask& mask, cv::Rect box, const cv::Mat& depth, int slack) {
  constexpr int kStep = 4;  // pixels; a sample of the mask does
  constexpr std::size_t kFewest = 10;
  std::vector<int> values;
  for (int y = box.y; y < box.br().y; y += kStep) {
    for (int x = box.x; x < box.br().x; x += kStep) {
      const int raw = mask.test(x, y) ? depth_at(depth, x, y) : 0;
      if (raw > 0) values.push_back(raw);
    }
  }
  if (values.size() < kFewest) return {};
  const int centre = median(values);
  for (int& raw : values) raw = std::abs(raw - centre);
  // The half of a mask that is nearest to the median is within one deviation; what a mask holds of the
  // background must not widen the range, so the rest of a body is left to the slack.
  return {centre, median(values) * 3 / 2 + slack};
}

/// One mask on its way from one view to another.
class Carry {
 public:
  Carry(const Camera& camera, const MaskCarrierOptions& options, const CarryView& from, const CarryView& to,
        const BitMask& mask)
      : camera_(camera),
        options_(options),
        from_(from),
        to_(to),
        mask_(mask),
        box_(mask.bounding_box()),
        slack_(static_cast<int>(options.depth_slack * camera.depth_scale)) {
    if (!box_.empty()) range_ = depth_range(mask_, box_, from_.depth, slack_);
    new_range_ = range_;
  }

  [[nodiscard]] CarriedMask run() {
    CarriedMask carried;
    carried.mask = BitMask(mask_.size());
    if (box_.empty()) return carried;
    const std::vector<cv::Point2f> points = choose_points();
    const cv::Point shift = coarse_shift(camera_shift());
    std::vector<PointMove> moves = follow(points, shift);
    carried.followed = static_cast<int>(moves.size()) >= options_.min_points;
    carried.support =
        points.empty() ? 0.0 : static_cast<double>(moves.size()) / static_cast<double>(points.size());
    if (carried.followed) {
      follow_depth(moves);
    } else {
      moves = moves_of_all(shift);
    }
    if (moves.empty()) return carried;
    const MotionField field(moves, mask_.size(), options_.reach);
    warp(field, carried);
    if (options_.growth > 0 && new_range_.known()) grow(field, carried.mask);
    return carried;
  }

 private:
  [[nodiscard]] bool in_image(cv::Point2f p) const {
    return p.x >= 0.0F && p.y >= 0.0F && p.x <= static_cast<float>(mask_.size().width - 1) &&
           p.y <= static_cast<float>(mask_.size().height - 1);
  }
  [[nodiscard]] bool may_be_instance(int raw) const {
    return raw == 0 || !range_.known() || range_.holds(raw);
  }

  cv::Point camera_shift() const;
  cv::Point coarse_shift(cv::Point expected) const;
  std::vector<cv::Point2f> choose_points() const;
  std::vector<PointMove> follow(const std::vector<cv::Point2f>& points, cv::Point shift) const;
  void follow_depth(const std::vector<PointMove>& moves);
  std::vector<PointMove> moves_of_all(cv::Point shift) const;
  void warp(const MotionField& field, CarriedMask& carried) const;
  void grow(const MotionField& field, BitMask& mask) const;

  const Camera& camera_;
  const MaskCarrierOptions& options_;
  const CarryView &from_, &to_;
  const BitMask& mask_;
  cv::Rect box_;
  int slack_;  // raw depth
  DepthRange range_, new_range_;
};

// The shift of the coarse image, in its pixels, by which an instance moves that stands still in the world.
cv::Point Carry::camera_shift() const {
  const std::optional<SE3> T_to_from = motion_between(from_, to_);
  constexpr double kNearest = 0.1;  // m; what lies nearer to the new camera, or behind it, is out of view
  if (!T_to_from || !range_.known()) return {0, 0};
  const Eigen::Vector2d before(box_.x + 0.5 * box_.width, box_.y + 0.5 * box_.height);
  const Eigen::Vector3d point =
      *T_to_from * camera_.unproject(camera_.undistort(before), range_.centre / camera_.depth_scale);
  if (point.z() < kNearest) return {0, 0};
  const Eigen::Vector2d shift = (camera_.distort(camera_.project(point)) - before) / kCoarse;
  if (!(shift.norm() < mask_.size().width / kCoarse)) return {0, 0};
  return {static_cast<int>(std::lround(shift.x())), static_cast<int>(std::lround(shift.y()))};
}

// The shift of the coarse image, in its pixels, at which grey and depth of the mask's pixels fit best.
cv::Point Carry::coarse_shift(cv::Point expected) const {
  struct Sample {
    int x, y, grey, raw;
  };
  constexpr int kGreyLimit = 40;    // a larger difference is just as wrong
  constexpr int kDepthWeight = 60;  // of a depth that is the instance's no more: above any grey difference
  constexpr float kFewest = 0.4F;   // share of the samples that must stay in the image
  constexpr float kShiftPenalty =
      0.3F;  // grey values per coarse pixel off what is expected: only with a reason
  const cv::Mat &grey = from_.coarse_grey, &new_grey = to_.coarse_grey;
  std::vector<Sample> samples;
  for (int y = box_.y / kCoarse; y * kCoarse < box_.br().y && y < grey.rows; ++y) {
    for (int x = box_.x / kCoarse; x * kCoarse < box_.br().x && x < grey.cols; ++x) {
      const int u = x * kCoarse + kCoarse / 2, v = y * kCoarse + kCoarse / 2;
      if (u >= mask_.size().width || v >= mask_.size().height || !mask_.test(u, v)) continue;
      const int raw = depth_at(from_.coarse_depth, x, y);
      if (may_be_instance(raw)) samples.push_back({x, y, grey.at<std::uint8_t>(y, x), raw});
    }
  }
  constexpr std::size_t kSamples = 200;  // more do not change the choice
  if (const std::size_t step = samples.size() / kSamples + 1; step > 1) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < samples.size(); i += step) samples[kept++] = samples[i];
    samples.resize(kept);
  }
  const auto cost = [&](int dx, int dy) {
    int sum = 0, count = 0;
    for (const Sample& s : samples) {
      const int x = s.x + dx, y = s.y + dy;
      if (x < 0 || y < 0 || x >= new_grey.cols || y >= new_grey.rows) continue;
      ++count;
      sum += std::min(std::abs(new_grey.at<std::uint8_t>(y, x) - s.grey), kGreyLimit);
      const int raw = depth_at(to_.coarse_depth, x, y);
      if (s.raw > 0 && raw > 0 && std::abs(raw - s.raw) > 2 * slack_) sum += kDepthWeight;
    }
    if (static_cast<float>(count) < kFewest * static_cast<float>(samples.size()))
      return std::numeric_limits<float>::infinity();
    return static_cast<float>(sum) / static_cast<float>(std::max(count, 1)) +
           kShiftPenalty * static_cast<float>(std::hypot(dx - expected.x, dy - expected.y));
  };
  const int reach = static_cast<int>(options_.max_shift * mask_.size().width) / kCoarse;
  cv::Point best = expected;
  float least = cost(expected.x, expected.y);
  const auto consider = [&](int dx, int dy) {
    const float c = cost(dx, dy);
    if (c < least) {
      least = c;
      best = {dx, dy};
    }
  };
  for (int dy = -reach / 2; dy <= reach / 2; dy += 2) {
    for (int dx = -reach; dx <= reach; dx += 2) consider(expected.x + dx, expected.y + dy);
  }
  const cv::Point around = best;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) consider(around.x + dx, around.y + dy);
  }
  return best;
}

// One point per cell of a grid over the mask: where the gradient is strongest, off the outline, at the
// instance's depth. Positions in the halved image.
std::vector<cv::Point2f> Carry::choose_points() const {
  constexpr int kMargin = 3;  // pixels from the outline, where a patch shows two things
  const cv::Mat& gradients = from_.pyramid[1];
  constexpr int kFinestCell = 4;  // halved pixels; nearer points say the same
  const int cell = std::max(kFinestCell, static_cast<int>(std::sqrt(mask_.area() / (4.0 * options_.points))));
  const auto inside = [&](int u, int v) {
    return u >= kMargin && v >= kMargin && u + kMargin < mask_.size().width &&
           v + kMargin < mask_.size().height && mask_.test(u - kMargin, v) && mask_.test(u + kMargin, v) &&
           mask_.test(u, v - kMargin) && mask_.test(u, v + kMargin) &&
           may_be_instance(depth_at(from_.depth, u, v));
  };
  const cv::Point end(std::min(box_.br().x / 2, gradients.cols), std::min(box_.br().y / 2, gradients.rows));
  std::vector<cv::Point2f> points;
  for (int top = box_.y / 2; top < end.y; top += cell) {
    for (int left = box_.x / 2; left < end.x; left += cell) {
      int strongest = 0;
      cv::Point2f point;
      for (int y = top; y < std::min(top + cell, end.y); ++y) {
        const auto* row = gradients.ptr<cv::Vec2s>(y);
        for (int x = left; x < std::min(left + cell, end.x); ++x) {
          const int strength = std::abs(row[x][0]) + std::abs(row[x][1]);
          if (strength > strongest && inside(2 * x, 2 * y)) {
            strongest = strength;
            point = cv::Point2f(static_cast<float>(x), static_cast<float>(y));
          }
        }
      }
      if (strongest > 0) points.push_back(point);
    }
  }
  return points;
}

// The points that are found again, forth and back.
std::vector<PointMove> Carry::follow(const std::vector<cv::Point2f>& points, cv::Point shift) const {
  if (points.empty()) return {};
  const cv::Size window(options_.window, options_.window);
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 10, 0.03);
  std::vector<cv::Point2f> there, back = points;
  for (const cv::Point2f& p : points) there.push_back(p + cv::Point2f(shift * (kCoarse / 2)));
  std::vector<std::uint8_t> found_there, found_back;
  cv::calcOpticalFlowPyrLK(from_.pyramid, to_.pyramid, points, there, found_there, cv::noArray(), window,
                           kLevels, stop, cv::OPTFLOW_USE_INITIAL_FLOW);
  cv::calcOpticalFlowPyrLK(to_.pyramid, from_.pyramid, there, back, found_back, cv::noArray(), window,
                           kLevels, stop, cv::OPTFLOW_USE_INITIAL_FLOW);
  const auto in_full = [](cv::Point2f p) { return cv::Point2f(2.0F * p.x + 0.5F, 2.0F * p.y + 0.5F); };
  std::vector<PointMove> moves;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (found_there[i] == 0 || found_back[i] == 0) continue;
    if (2.0 * cv::norm(back[i] - points[i]) > options_.max_round_trip) continue;
    const PointMove move{in_full(points[i]), in_full(there[i])};
    if (in_image(move.to)) moves.push_back(move);
  }
  return moves;
}

// How much nearer or farther the instance is now.
void Carry::follow_depth(const std::vector<PointMove>& moves) {
  std::vector<int> changes;
  for (const PointMove& m : moves) {
    const int before = depth_at(from_.depth, static_cast<int>(m.from.x), static_cast<int>(m.from.y));
    const int now = depth_at(to_.depth, static_cast<int>(m.to.x), static_cast<int>(m.to.y));
    if (before > 0 && now > 0) changes.push_back(now - before);
  }
  if (static_cast<int>(changes.size()) >= options_.min_points) new_range_.centre += median(changes);
}

// Where nothing can be followed, the mask moves as a whole.
std::vector<PointMove> Carry::moves_of_all(cv::Point shift) const {
  const cv::Point2f centre = 0.5F * cv::Point2f(box_.tl() + box_.br());
  return {{centre, centre + cv::Point2f(shift * kCoarse)}};
}

void Carry::warp(const MotionField& field, CarriedMask& carried) const {
  const cv::Size size = mask_.size();
  const cv::Rect target = field.moved(box_);
  const int change = new_range_.centre - range_.centre;
  std::vector<cv::Point2f> sources(static_cast<std::size_t>(target.width));
  int measured = 0, fitting = 0;
  for (int y = target.y; y < target.br().y; ++y) {
    field.sources(target.x, target.br().x, y, sources.data());
    const auto* depth = to_.depth.ptr<std::uint16_t>(y);
    for (int i = 0; i < target.width; ++i) {
      const cv::Point2f source = sources[static_cast<std::size_t>(i)] + cv::Point2f(0.5F, 0.5F);
      if (source.x < 0.0F || source.y < 0.0F) continue;
      const int u = static_cast<int>(source.x), v = static_cast<int>(source.y);
      if (u >= size.width || v >= size.height || !mask_.test(u, v)) continue;
      const int x = target.x + i, raw = depth[x];
      if (raw > 0 && new_range_.known()) {
        ++measured;
        const int before = depth_at(from_.depth, u, v);
        if (new_range_.holds(raw)) {
          ++fitting;
        } else if (before == 0 || std::abs(raw - before - change) > slack_) {
          continue;
        }
      }
      carried.mask.set(x, y);
    }
  }
  if (measured > 0) carried.depth_fit = static_cast<double>(fitting) / measured;
}

// From the mask's outline outwards, ring by ring, on every second pixel.
void Carry::grow(const MotionField& field, BitMask& mask) const {
  constexpr int kStep = 2;
  const cv::Size size = mask.size();
  const cv::Size halved(size.width / kStep, size.height / kStep);
  cv::Rect box = mask.bounding_box();
  if (box.empty()) return;
  const auto came_into_view = [&](int x, int y) {
    const int raw = depth_at(to_.depth, x, y);
    if (raw == 0 || !new_range_.holds(raw)) return false;
    cv::Point2f source;
    field.sources(x, x + 1, y, &source);
    if (!in_image(source)) return true;
    const int before = depth_at(from_.depth, static_cast<int>(source.x), static_cast<int>(source.y));
    return before > 0 && !range_.holds(before);
  };
  const auto on = [&](int x, int y) { return mask.test(kStep * x, kStep * y); };
  std::vector<cv::Point> ring, next;
  const auto visit = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= halved.width || y >= halved.height || on(x, y)) return;
    if (!came_into_view(kStep * x, kStep * y)) return;
    for (int k = 0; k < kStep; ++k) mask.set_run(kStep * y + k, kStep * x, kStep * (x + 1));
    next.emplace_back(x, y);
  };
  for (int y = box.y / kStep; y < std::min(box.br().y / kStep + 1, halved.height); ++y) {
    for (int x = box.x / kStep; x < std::min(box.br().x / kStep + 1, halved.width); ++x) {
      if (on(x, y)) ring.emplace_back(x, y);
    }
  }
  for (int distance = 0; distance < options_.growth && !ring.empty(); distance += kStep) {
    next.clear();
    for (const cv::Point& p : ring) {
      visit(p.x - 1, p.y);
      visit(p.x + 1, p.y);
      visit(p.x, p.y - 1);
      visit(p.x, p.y + 1);
    }
    ring.swap(next);
  }
}

}  // namespace

std::optional<SE3> motion_between(const CarryView& from, const CarryView& to) {
  if (!from.T_wc || !to.T_wc) return std::nullopt;
  return to.T_wc->inverse() * *from.T_wc;
}

CarryView MaskCarrier::view(const RgbdFrame& frame, const std::optional<SE3>& T_wc) const {
  const cv::Size size(camera_.width, camera_.height);
  if (frame.color.size() != size || frame.depth.size() != size || frame.depth.type() != CV_16UC1) {
    throw std::invalid_argument("mask carrier: colour and depth must have the camera's size, depth 16 bits");
  }
  CarryView view;
  view.index = frame.index;
  view.timestamp = frame.timestamp;
  view.T_wc = T_wc;
  view.depth = frame.depth;
  cv::resize(frame.color, view.color, size / 2, 0, 0, cv::INTER_AREA);
  cv::Mat grey = view.color;
  if (grey.channels() == 3) cv::cvtColor(view.color, grey, cv::COLOR_BGR2GRAY);
  cv::buildOpticalFlowPyramid(grey, view.pyramid, {options_.window, options_.window}, kLevels);
  const cv::Size coarse((size.width + kCoarse - 1) / kCoarse, (size.height + kCoarse - 1) / kCoarse);
  cv::resize(grey, view.coarse_grey, coarse, 0, 0, cv::INTER_AREA);
  cv::resize(view.depth, view.coarse_depth, coarse, 0, 0, cv::INTER_NEAREST);
  return view;
}

std::vector<CarriedMask> MaskCarrier::carry(const CarryView& from, const std::vector<const BitMask*>& masks,
                                            const CarryView& to) const {
  std::vector<CarriedMask> carried;
  for (const BitMask* mask : masks) carried.push_back(Carry(camera_, options_, from, to, *mask).run());
  return carried;
}

}  // namespace ipl_slam
