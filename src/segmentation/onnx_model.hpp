#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "segmentation/tensor_info.hpp"

namespace ipl_slam {

/// A tensor's values, in row-major order; they belong to somebody else.
struct TensorView {
  const float* data = nullptr;
  std::vector<std::int64_t> shape;
};

/// Whether this build can run networks at all. Where it cannot, OnnxModel's constructor throws UserError.
[[nodiscard]] bool has_onnx_runtime();

/// A network from an ONNX file, run on the CPU by ONNX Runtime (https://onnxruntime.ai). The same input gives
/// the same output.
class OnnxModel {
 public:
  /// From the bytes of a file, whose name is for messages. `threads` work on one inference; they sleep
  /// between two. Throws UserError: no bytes, not an ONNX model, a build without ONNX Runtime.
  OnnxModel(const std::filesystem::path& file, const std::string& bytes, int threads);
  ~OnnxModel();
  OnnxModel(OnnxModel&&) noexcept;
  OnnxModel& operator=(OnnxModel&&) noexcept;

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const std::vector<TensorInfo>& inputs() const { return inputs_; }
  [[nodiscard]] const std::vector<TensorInfo>& outputs() const { return outputs_; }
  /// The text that the model's maker stored under a key; empty where there is none.
  [[nodiscard]] std::string metadata(const std::string& key) const;

  /// Runs a network of one float32 input and float32 outputs. The outputs are valid until the next run.
  /// Throws UserError where the network cannot be run on an input of this shape.
  [[nodiscard]] std::vector<TensorView> run(const TensorView& input);

 private:
  struct Implementation;
  std::filesystem::path file_;
  std::vector<TensorInfo> inputs_, outputs_;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace ipl_slam
