#include "segmentation/make_segmenter.hpp"

#include <utility>

#include "segmentation/forgetful_segmenter.hpp"

namespace ipl_slam {
namespace {

std::unique_ptr<Segmenter> make_chosen(const SegmentationOptions& options, const Camera& camera,
                                       std::uint64_t seed) {
  const std::string name = chosen_segmenter(options);
  if (name == "yolo") return std::make_unique<YoloSegmenter>(options.yolo);
  if (name == "masks") {
    return std::make_unique<MaskFolderSegmenter>(options.masks, cv::Size(camera.width, camera.height));
  }
  if (name == "geometric") return std::make_unique<GeometricSegmenter>(camera, options.geometric, seed);
  return nullptr;
}

}  // namespace

std::string chosen_segmenter(const SegmentationOptions& options) {
  if (options.segmenter != "auto") return options.segmenter;
  if (!options.masks.folder.empty()) return "masks";
  if (!options.yolo.model.empty()) return "yolo";
  return "geometric";
}

std::unique_ptr<Segmenter> make_segmenter(const SegmentationOptions& options, const Camera& camera,
                                          std::uint64_t seed) {
  std::unique_ptr<Segmenter> chosen = make_chosen(options, camera, seed);
  if (!chosen || options.miss_rate == 0.0) return chosen;
  return std::make_unique<ForgetfulSegmenter>(std::move(chosen), options.miss_rate, seed);
}

}  // namespace ipl_slam
