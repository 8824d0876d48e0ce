#include "segmentation/make_segmenter.hpp"

namespace ipl_slam {

std::string chosen_segmenter(const SegmentationOptions& options) {
  if (options.segmenter != "auto") return options.segmenter;
  if (!options.masks.folder.empty()) return "masks";
  if (!options.yolo.model.empty()) return "yolo";
  return "geometric";
}

std::unique_ptr<Segmenter> make_segmenter(const SegmentationOptions& options, const Camera& camera) {
  const std::string name = chosen_segmenter(options);
  if (name == "yolo") return std::make_unique<YoloSegmenter>(options.yolo);
  if (name == "masks") {
    return std::make_unique<MaskFolderSegmenter>(options.masks, cv::Size(camera.width, camera.height));
  }
  if (name == "geometric") return std::make_unique<GeometricSegmenter>(camera, options.geometric);
  return nullptr;
}

}  // namespace ipl_slam
