#include "segmentation/forgetful_segmenter.hpp"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

// Keeps these draws apart from those of other stages under the same seed.
constexpr std::uint64_t kStream = 0x6d697373;  // "miss"

}  // namespace

ForgetfulSegmenter::ForgetfulSegmenter(std::unique_ptr<Segmenter> segmenter, double miss_rate,
                                       std::uint64_t seed)
    : segmenter_(std::move(segmenter)), miss_rate_(miss_rate), seed_(seed) {
  if (!segmenter_ || !(miss_rate >= 0.0 && miss_rate <= 1.0)) {
    throw std::invalid_argument("forgetful segmenter: no segmenter, or a miss rate beyond 0 to 1");
  }
}

std::vector<Instance> ForgetfulSegmenter::segment(const RgbdFrame& frame) {
  const std::uint64_t of_frame = hash64(hash64(seed_, kStream), frame.index);
  std::vector<Instance> found = segmenter_->segment(frame), kept;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (unit_from_bits(hash64(of_frame, i)) >= miss_rate_) kept.push_back(std::move(found[i]));
  }
  found_ += found.size();
  forgotten_ += found.size() - kept.size();
  return kept;
}

std::vector<std::string> ForgetfulSegmenter::remarks() const {
  std::vector<std::string> remarks = segmenter_->remarks();
  remarks.push_back(fmt::format("{} of {} detections were forgotten on purpose (segmentation.miss_rate = {})",
                                forgotten_, found_, miss_rate_));
  return remarks;
}

}  // namespace ipl_slam
