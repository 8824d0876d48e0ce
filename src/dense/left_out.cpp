#include "dense/left_out.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "segmentation/bit_mask.hpp"
#include "segmentation/class_role.hpp"

namespace ipl_slam {
namespace {

constexpr double kReferenceWidth = 640.0;  // pixels, that LeftOutOptions speaks of

int scaled(int pixels, const cv::Mat& image) {
  return static_cast<int>(std::lround(pixels * image.cols / kReferenceWidth));
}

/// The least depth of a mask around a place.
class NearestOfMask {
 public:
  // 16 to 32 pixels around, 5 cm and more at the range of a room: over the edges where masks spill.
  static constexpr int kBlock = 16;
  static constexpr int kNone = std::numeric_limits<int>::max() / 2;

  NearestOfMask(const cv::Mat& mask, const cv::Mat& depth)
      : blocks_((mask.rows - 1) / kBlock + 1, (mask.cols - 1) / kBlock + 1, kNone) {
    for (int y = 0; y < mask.rows; ++y) {
      const auto* in_mask = mask.ptr<std::uint8_t>(y);
      const auto* z = depth.ptr<std::uint16_t>(y);
      int* row = blocks_[y / kBlock];
      for (int x = 0; x < mask.cols; ++x) {
        if (in_mask[x] != 0 && z[x] != 0) row[x / kBlock] = std::min(row[x / kBlock], int{z[x]});
      }
    }
    const cv::Mat_<int> own = blocks_.clone();
    for (int y = 0; y < own.rows; ++y) {
      for (int x = 0; x < own.cols; ++x) {
        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, own.rows - 1); ++v) {
          for (int u = std::max(x - 1, 0); u <= std::min(x + 1, own.cols - 1); ++u) {
            blocks_(y, x) = std::min(blocks_(y, x), own(v, u));
          }
        }
      }
    }
  }

  [[nodiscard]] int at(int x, int y) const { return blocks_(y / kBlock, x / kBlock); }

 private:
  cv::Mat_<int> blocks_;
};

/// Follows surfaces from a mask into what lies around it.
class LimbSearch {
 public:
  LimbSearch(const BitMask& core, const cv::Mat& depth, const Camera& camera, const LeftOutOptions& options)
      : options_(options),
        inside_(1, 1, depth.cols, depth.rows),
        mask_(core.to_image()),
        nearest_(mask_, depth),
        thickness_(static_cast<int>(std::lround(options.thickness * camera.depth_scale))) {
    // A frame without depth, so that every pixel has neighbours.
    depth_ = cv::Mat::zeros(depth.rows + 2, depth.cols + 2, CV_16UC1);
    state_ = cv::Mat::zeros(depth_.size(), CV_8UC1);
    depth.copyTo(depth_(inside_));
    state_(inside_).setTo(kAround, dilated(core, scaled(options.reach, depth)).to_image());
    state_(inside_).setTo(kMask, mask_);
    z_ = depth_.ptr<std::uint16_t>();
    states_ = state_.ptr<std::uint8_t>();
    neighbours_ = {-depth_.cols, -1, 1, depth_.cols};
  }

  /// 255 on the limbs.
  [[nodiscard]] cv::Mat limbs() {
    for (int y = 0; y < inside_.height; ++y) {
      for (int x = 0; x < inside_.width; ++x) {
        if (mask_.at<std::uint8_t>(y, x) == 0) continue;
        const int pixel = (y + 1) * depth_.cols + x + 1;
        // What the mask holds of the background behind somebody is nothing to start from.
        if (z_[pixel] == 0 || z_[pixel] > nearest_.at(x, y) + thickness_) continue;
        for (const int n : neighbours_) {
          if (states_[pixel + n] == kAround && goes_on(pixel, pixel + n)) follow(pixel + n);
        }
      }
    }
    return state_(inside_) == kLimb;
  }

 private:
  enum State : std::uint8_t { kFar, kAround, kMask, kFollowed, kLimb };

  [[nodiscard]] bool goes_on(int from, int to) const {
    return z_[to] != 0 && std::abs(int{z_[to]} - int{z_[from]}) <= options_.step * z_[from];
  }

  // Takes the whole surface around `start`, and judges it by its outline.
  void follow(int start) {
    int in_front = 0, otherwise = 0;
    surface_.assign(1, start);
    states_[start] = kFollowed;
    for (std::size_t i = 0; i < surface_.size(); ++i) {
      const int from = surface_[i];
      for (const int n : neighbours_) {
        const int to = from + n;
        if (z_[to] == 0 || states_[to] == kFollowed || states_[to] == kLimb) continue;
        if (!goes_on(from, to)) {
          ++(z_[to] > z_[from] ? in_front : otherwise);
        } else if (states_[to] == kFar) {
          ++otherwise;
        } else if (states_[to] == kAround) {
          states_[to] = kFollowed;
          surface_.push_back(to);
        }
      }
    }
    if (in_front <= options_.in_front * (in_front + otherwise)) return;
    for (const int pixel : surface_) states_[pixel] = kLimb;
  }

  LeftOutOptions options_;
  cv::Rect inside_;  // of the images with a frame
  cv::Mat mask_;
  NearestOfMask nearest_;
  int thickness_;  // raw units
  cv::Mat depth_, state_;
  const std::uint16_t* z_ = nullptr;
  std::uint8_t* states_ = nullptr;
  std::array<int, 4> neighbours_{};
  std::vector<int> surface_;
};

}  // namespace

bool is_left_out(const ViewInstance& instance, const std::set<InstanceId>& moved,
                 const LeftOutOptions& options) {
  return (options.movers && class_role(instance.class_name) == ClassRole::likely_mover) ||
         (options.moved && moved.contains(instance.id));
}

cv::Mat left_out_mask(const cv::Mat& labels, const cv::Mat& depth, const std::vector<ViewInstance>& instances,
                      const std::set<InstanceId>& moved, const Camera& camera,
                      const LeftOutOptions& options) {
  if (labels.type() != CV_8UC1 || depth.type() != CV_16UC1 || labels.size() != depth.size()) {
    throw std::invalid_argument("left_out_mask: images of another size or type");
  }
  cv::Mat_<std::uint8_t> is_out(1, 256, std::uint8_t{0});  // by label
  for (std::size_t k = 0; k < instances.size() && k < 255; ++k) {
    if (is_left_out(instances[k], moved, options)) is_out(0, static_cast<int>(k) + 1) = 255;
  }
  cv::Mat image;
  cv::LUT(labels, is_out, image);
  const BitMask core = BitMask::from_image(image);
  if (core.none()) return image;
  cv::Mat mask = dilated(core, scaled(options.grow, labels)).to_image();
  if (options.reach > 0) mask |= LimbSearch(core, depth, camera, options).limbs();
  return mask;
}

}  // namespace ipl_slam
