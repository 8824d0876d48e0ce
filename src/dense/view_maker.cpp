#include "dense/view_maker.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <stdexcept>
#include <tuple>

#include <opencv2/imgproc.hpp>

#include "segmentation/class_role.hpp"

namespace ipl_slam {
namespace {

constexpr std::size_t kMostInstances = 255;  // 8 bits a label, 0 = nobody

// Best first.
bool comes_before(const TrackedInstance& a, const TrackedInstance& b) {
  const auto key = [](const TrackedInstance& t) {
    return std::tuple(class_role(t.instance.class_name) != ClassRole::likely_mover, -t.instance.score, t.id);
  };
  return key(a) < key(b);
}

void draw(const BitMask& mask, std::uint8_t label, cv::Mat& labels) {
  constexpr int kWordBits = 64;
  for (int y = 0; y < labels.rows; ++y) {
    const std::uint64_t* words = mask.row(y);
    auto* pixels = labels.ptr<std::uint8_t>(y);
    for (int w = 0; w < mask.words_per_row(); ++w) {
      for (std::uint64_t bits = words[w]; bits != 0; bits &= bits - 1) {
        pixels[w * kWordBits + std::countr_zero(bits)] = label;
      }
    }
  }
}

}  // namespace

Camera pinhole(const Camera& camera) {
  Camera result = camera;
  result.k1 = result.k2 = result.p1 = result.p2 = result.k3 = 0.0;
  return result;
}

ViewMaker::ViewMaker(const Camera& camera) : size_(camera.width, camera.height) {
  if (!camera.distorted()) return;
  cv::Mat x(size_, CV_32FC1), y(size_, CV_32FC1);
  for (int v = 0; v < size_.height; ++v) {
    for (int u = 0; u < size_.width; ++u) {
      const Eigen::Vector2d source = camera.distort({u, v});
      x.at<float>(v, u) = static_cast<float>(source.x());
      y.at<float>(v, u) = static_cast<float>(source.y());
    }
  }
  cv::Mat none;
  cv::convertMaps(x, y, nearest_map_, none, CV_16SC2, true);
  cv::convertMaps(x, y, linear_map_, linear_weights_, CV_16SC2, false);
}

cv::Mat ViewMaker::undistorted(const cv::Mat& image, bool nearest) const {
  if (nearest_map_.empty()) return image;
  cv::Mat result;
  if (nearest) {
    cv::remap(image, result, nearest_map_, cv::noArray(), cv::INTER_NEAREST);
  } else {
    cv::remap(image, result, linear_map_, linear_weights_, cv::INTER_LINEAR);
  }
  return result;
}

DenseView ViewMaker::make(double timestamp, const cv::Mat& color, const cv::Mat& depth,
                          const std::vector<TrackedInstance>& instances) const {
  const bool fits = color.size() == size_ && depth.size() == size_ && depth.type() == CV_16UC1 &&
                    (color.type() == CV_8UC3 || color.type() == CV_8UC1);
  if (!fits) throw std::invalid_argument("ViewMaker: images of another size or type");

  std::vector<const TrackedInstance*> best;
  for (const TrackedInstance& tracked : instances) {
    if (tracked.instance.mask.size() != size_) throw std::invalid_argument("ViewMaker: mask of another size");
    best.push_back(&tracked);
  }
  std::stable_sort(best.begin(), best.end(),
                   [](const auto* a, const auto* b) { return comes_before(*a, *b); });
  if (best.size() > kMostInstances) best.resize(kMostInstances);

  DenseView view;
  view.timestamp = timestamp;
  cv::Mat labels = cv::Mat::zeros(size_, CV_8UC1);
  for (const TrackedInstance* tracked : best) {
    view.instances.push_back({tracked->id, tracked->instance.class_name, tracked->instance.score});
  }
  // The best last, over the others.
  for (std::size_t k = best.size(); k > 0; --k) {
    draw(best[k - 1]->instance.mask, static_cast<std::uint8_t>(k), labels);
  }
  view.labels = best.empty() ? labels : undistorted(labels, true);
  view.depth = undistorted(depth, true);
  view.color = undistorted(color, false);
  if (view.color.channels() == 1) {
    cv::Mat bgr;
    cv::cvtColor(view.color, bgr, cv::COLOR_GRAY2BGR);
    view.color = bgr;
  }
  return view;
}

}  // namespace ipl_slam
