#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "segmentation/segmenter.hpp"

namespace ipl_slam {

/// A segmenter that forgets some of what another one finds, to see how well the stages behind it bear that.
/// Each detection is forgotten with the same probability, whatever became of the others; which ones depends
/// on the seed, the frame's index and the detection's place in the frame, so a frame always loses the same.
class ForgetfulSegmenter : public Segmenter {
 public:
  /// miss_rate: share of the detections that is forgotten, 0 to 1; `segmenter` is not null. Throws
  /// std::invalid_argument otherwise.
  ForgetfulSegmenter(std::unique_ptr<Segmenter> segmenter, double miss_rate, std::uint64_t seed);

  [[nodiscard]] std::vector<Instance> segment(const RgbdFrame& frame) override;
  /// Of the segmenter that does the work.
  [[nodiscard]] std::string name() const override { return segmenter_->name(); }
  /// Those of the other segmenter, and how many detections were forgotten.
  [[nodiscard]] std::vector<std::string> remarks() const override;

 private:
  std::unique_ptr<Segmenter> segmenter_;
  double miss_rate_;
  std::uint64_t seed_;
  std::size_t found_ = 0, forgotten_ = 0;
};

}  // namespace ipl_slam
