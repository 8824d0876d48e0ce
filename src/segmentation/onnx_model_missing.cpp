// Stands in for onnx_model.cpp where CMake found no ONNX Runtime.
#include <ipl_slam/error.hpp>

#include "segmentation/onnx_model.hpp"

namespace ipl_slam {

struct OnnxModel::Implementation {};

bool has_onnx_runtime() {
  return false;
}

OnnxModel::OnnxModel(const std::filesystem::path&, const std::string&, int) {
  throw UserError(
      "this build has no YOLO segmenter: ONNX Runtime was not found when it was built; './dev build' "
      "installs it, or use --segmenter masks or geometric");
}

OnnxModel::~OnnxModel() = default;
OnnxModel::OnnxModel(OnnxModel&&) noexcept = default;
OnnxModel& OnnxModel::operator=(OnnxModel&&) noexcept = default;

std::string OnnxModel::metadata(const std::string&) const {
  return {};
}
std::vector<TensorView> OnnxModel::run(const TensorView&) {
  return {};
}

}  // namespace ipl_slam
