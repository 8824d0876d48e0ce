// Stands in for onnx_model.cpp where CMake found no ONNX Runtime.
#include <ipl_slam/error.hpp>

#include "segmentation/onnx_model.hpp"

namespace ipl_slam {

struct OnnxModel::Implementation {
  std::filesystem::path file;
  std::vector<TensorInfo> inputs, outputs;
};

bool has_onnx_runtime() {
  return false;
}

OnnxModel::OnnxModel(const std::filesystem::path&, const std::string&, int) {
  throw UserError(
      "this build has no YOLO segmenter: ONNX Runtime was not found when it was built; './dev build' "
      "installs "
      "it, or use --segmenter masks or geometric");
}

OnnxModel::~OnnxModel() = default;
OnnxModel::OnnxModel(OnnxModel&&) noexcept = default;
OnnxModel& OnnxModel::operator=(OnnxModel&&) noexcept = default;

const std::filesystem::path& OnnxModel::file() const {
  return implementation_->file;
}
const std::vector<TensorInfo>& OnnxModel::inputs() const {
  return implementation_->inputs;
}
const std::vector<TensorInfo>& OnnxModel::outputs() const {
  return implementation_->outputs;
}
std::string OnnxModel::metadata(const std::string&) const {
  return {};
}
std::vector<TensorView> OnnxModel::run(const TensorView&) {
  return {};
}

}  // namespace ipl_slam
