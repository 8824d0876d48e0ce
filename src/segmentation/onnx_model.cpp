#include "segmentation/onnx_model.hpp"

#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <onnxruntime_cxx_api.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

/// One for the whole program, as ONNX Runtime wants it.
Ort::Env& environment() {
  static Ort::Env environment(ORT_LOGGING_LEVEL_FATAL, "ipl_slam");  // errors come as exceptions
  return environment;
}

Ort::SessionOptions session_options(int threads) {
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(threads);
  options.SetInterOpNumThreads(1);
  options.SetExecutionMode(ORT_SEQUENTIAL);
  options.SetGraphOptimizationLevel(ORT_ENABLE_ALL);
  options.SetDeterministicCompute(true);
  // Waiting threads sleep: spinning ones would take the processor from tracking, which runs beside.
  options.AddConfigEntry("session.intra_op.allow_spinning", "0");
  return options;
}

std::string_view type_name(ONNXTensorElementDataType type) {
  switch (type) {
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT:
      return "float32";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT16:
      return "float16";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_BFLOAT16:
      return "bfloat16";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_DOUBLE:
      return "float64";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_INT8:
      return "int8";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_INT16:
      return "int16";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_INT32:
      return "int32";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_INT64:
      return "int64";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_UINT8:
      return "uint8";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_UINT16:
      return "uint16";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_UINT32:
      return "uint32";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_UINT64:
      return "uint64";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_BOOL:
      return "bool";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_STRING:
      return "string";
    default:
      return "other";  // complex numbers, and those of 8 bits and less
  }
}

TensorInfo tensor_info(const Ort::AllocatedStringPtr& name, const Ort::TypeInfo& type) {
  if (type.GetONNXType() != ONNX_TYPE_TENSOR) return {name.get(), "other", {}};
  const auto tensor = type.GetTensorTypeAndShapeInfo();
  return {name.get(), std::string(type_name(tensor.GetElementType())), tensor.GetShape()};
}

std::string first_line(const char* text) {
  const std::string_view all(text);
  return std::string(all.substr(0, all.find('\n')));
}

}  // namespace

struct OnnxModel::Implementation {
  Ort::Session session;
  std::vector<Ort::Value> results;  ///< of the last run
};

bool has_onnx_runtime() {
  return true;
}

OnnxModel::OnnxModel(const std::filesystem::path& file, const std::string& bytes, int threads) : file_(file) {
  if (bytes.empty()) throw UserError(fmt::format("'{}' is empty; an ONNX model is needed", file.string()));
  try {
    Ort::Session session(environment(), bytes.data(), bytes.size(), session_options(threads));
    Ort::AllocatorWithDefaultOptions allocator;
    for (std::size_t i = 0; i < session.GetInputCount(); ++i) {
      inputs_.push_back(
          tensor_info(session.GetInputNameAllocated(i, allocator), session.GetInputTypeInfo(i)));
    }
    for (std::size_t i = 0; i < session.GetOutputCount(); ++i) {
      outputs_.push_back(
          tensor_info(session.GetOutputNameAllocated(i, allocator), session.GetOutputTypeInfo(i)));
    }
    implementation_ = std::make_unique<Implementation>(Implementation{std::move(session), {}});
  } catch (const Ort::Exception& error) {
    throw UserError(fmt::format("'{}' is no ONNX model that ONNX Runtime can load ({})", file.string(),
                                first_line(error.what())));
  }
}

OnnxModel::~OnnxModel() = default;
OnnxModel::OnnxModel(OnnxModel&&) noexcept = default;
OnnxModel& OnnxModel::operator=(OnnxModel&&) noexcept = default;

std::string OnnxModel::metadata(const std::string& key) const {
  Ort::AllocatorWithDefaultOptions allocator;
  const auto text =
      implementation_->session.GetModelMetadata().LookupCustomMetadataMapAllocated(key.c_str(), allocator);
  return text ? std::string(text.get()) : std::string();
}

std::vector<TensorView> OnnxModel::run(const TensorView& input) {
  Implementation& self = *implementation_;
  std::size_t count = 1;
  for (const std::int64_t size : input.shape) count *= static_cast<std::size_t>(size);
  // CreateTensor takes no const pointer; an input is only read.
  const Ort::Value tensor = Ort::Value::CreateTensor<float>(
      Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault), const_cast<float*>(input.data), count,
      input.shape.data(), input.shape.size());

  const char* input_name = inputs_.at(0).name.c_str();
  std::vector<const char*> output_names;
  for (const TensorInfo& output : outputs_) output_names.push_back(output.name.c_str());
  try {
    self.results = self.session.Run(Ort::RunOptions{nullptr}, &input_name, &tensor, 1, output_names.data(),
                                    output_names.size());
  } catch (const Ort::Exception& error) {
    throw UserError(fmt::format("'{}' cannot be run on {} ({})", file_.string(),
                                describe({inputs_[0].name, "float32", input.shape}),
                                first_line(error.what())));
  }

  std::vector<TensorView> views;
  for (const Ort::Value& result : self.results) {
    views.push_back({result.GetTensorData<float>(), result.GetTensorTypeAndShapeInfo().GetShape()});
  }
  return views;
}

}  // namespace ipl_slam
