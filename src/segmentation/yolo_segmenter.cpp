#include "segmentation/yolo_segmenter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/log.hpp"
#include "common/stopwatch.hpp"
#include "common/text_file.hpp"
#include "segmentation/class_names.hpp"
#include "segmentation/onnx_softmax.hpp"

namespace ipl_slam {
namespace {

constexpr int kStride = 32;  // of the network's coarsest level; an input side is a multiple of it
constexpr std::int64_t kOpen = -1;

OnnxModel load(const YoloOptions& options) {
  if (options.model.empty()) {
    throw UserError(
        "the segmenter yolo needs a model; give an ONNX file with --model FILE, in the setting "
        "segmentation.yolo.model or in the environment variable IPL_SLAM_MODEL");
  }
  std::string bytes = read_file(options.model);
  if (mend_softmax_opset(bytes)) {
    log().debug("'{}' is read as opset 13, which its Softmax over axis 1 is meant for", options.model);
  }
  return OnnxModel(options.model, bytes, options.threads);
}

std::string describe_all(const std::vector<TensorInfo>& tensors) {
  std::string text;
  for (const TensorInfo& tensor : tensors) text += (text.empty() ? "" : ", ") + describe(tensor);
  return text;
}

bool one_or_open(std::int64_t size) {
  return size == 1 || size == kOpen;
}

bool is_image(const TensorInfo& input) {
  const auto& shape = input.shape;
  return input.type == "float32" && shape.size() == 4 && one_or_open(shape[0]) && shape[1] == 3 &&
         shape[2] != 0 && shape[3] != 0;
}

/// Channels first, as segmenting exports have it. Networks with suppression built in, and transposed ones,
/// give fewer values per place than there are places the other way round; anchors may only be fewer than
/// channels where the input is so small that it has no more of them (strides 8, 16 and 32).
bool is_per_anchor(const TensorInfo& output, const TensorInfo& image, std::int64_t coefficients) {
  const auto& shape = output.shape;
  if (output.type != "float32" || shape.size() != 3 || !one_or_open(shape[0])) return false;
  if (shape[1] <= 4 + coefficients) return false;
  if (shape[2] == kOpen || shape[2] >= shape[1]) return true;
  return shape[2] * kStride * kStride == image.shape[2] * image.shape[3] * (1 + 4 + 16);
}

bool is_prototypes(const TensorInfo& output) {
  const auto& shape = output.shape;
  return output.type == "float32" && shape.size() == 4 && one_or_open(shape[0]) && shape[1] > 0;
}

/// The number of classes and coefficients; throws UserError if this is no segmenting YOLO network.
YoloOutput check_layout(const OnnxModel& model) {
  const auto& inputs = model.inputs();
  const auto& outputs = model.outputs();
  const bool fits = inputs.size() == 1 && is_image(inputs[0]) && outputs.size() == 2 &&
                    is_prototypes(outputs[1]) && is_per_anchor(outputs[0], inputs[0], outputs[1].shape[1]);
  if (!fits) {
    throw UserError(fmt::format(
        "'{}' is no segmenting YOLOv8 or YOLO11 export: expected one input float32[1,3,H,W] and the outputs "
        "float32[1,4+classes+M,anchors] and float32[1,M,H/4,W/4], found {} -> {}; export a model whose name "
        "ends in -seg, with format=onnx and neither half nor nms",
        model.file().string(), describe_all(inputs), describe_all(outputs)));
  }
  YoloOutput layout;
  layout.coefficients = static_cast<int>(outputs[1].shape[1]);
  layout.classes = static_cast<int>(outputs[0].shape[1]) - 4 - layout.coefficients;
  return layout;
}

/// The input size that the model fixes, 0 where it leaves a side open.
cv::Size fixed_size(const OnnxModel& model) {
  const auto& shape = model.inputs()[0].shape;
  return {static_cast<int>(std::max<std::int64_t>(0, shape[3])),
          static_cast<int>(std::max<std::int64_t>(0, shape[2]))};
}

int next_multiple(double length) {
  return kStride * std::max(1, static_cast<int>(std::ceil(length / kStride)));
}

}  // namespace

YoloSegmenter::YoloSegmenter(const YoloOptions& options)
    : options_(options), model_(load(options)), layout_(check_layout(model_)) {
  class_names_ = ipl_slam::class_names(model_.metadata("names"), layout_.classes);
  selected_ = select_classes(options_.classes, class_names_);
}

double YoloSegmenter::max_scale(cv::Size image) const {
  return static_cast<double>(options_.image_side) / std::max(image.width, image.height);
}

cv::Size YoloSegmenter::input_size(cv::Size image) const {
  const double scale = max_scale(image);
  const cv::Size fixed = fixed_size(model_);
  return {fixed.width > 0 ? fixed.width : next_multiple(image.width * scale),
          fixed.height > 0 ? fixed.height : next_multiple(image.height * scale)};
}

std::vector<std::string> YoloSegmenter::remarks() const {
  if (image_.empty()) return {};
  const cv::Size given = input_size(image_);
  const double scale = max_scale(image_);
  const cv::Size needed(next_multiple(image_.width * scale), next_multiple(image_.height * scale));
  if (given.area() < 2 * needed.area()) return {};
  return {fmt::format(
      "the network's input of {}x{} is far larger than the picture it is shown "
      "(segmentation.yolo.image_side {}); an "
      "export with imgsz={},{} takes a fraction of the time, and a larger image_side costs nothing",
      given.width, given.height, options_.image_side, needed.height, needed.width)};
}

std::vector<Instance> YoloSegmenter::segment(const RgbdFrame& frame) {
  Stopwatch stopwatch;
  const cv::Size image = image_ = frame.color.size();
  const Letterbox letterbox(image, input_size(image), max_scale(image));
  fill_letterbox(frame.color, letterbox, planes_);
  times_.preprocess = stopwatch.restart();
  const YoloOutput output = run(letterbox.input);
  times_.inference = stopwatch.restart();
  std::vector<Instance> instances = decode(output, letterbox);
  times_.postprocess = stopwatch.milliseconds();
  return instances;
}

YoloOutput YoloSegmenter::run(cv::Size input) {
  const std::vector<TensorView> outputs = model_.run({planes_.data(), {1, 3, input.height, input.width}});
  YoloOutput output = layout_;
  const auto& rows = outputs[0].shape;
  const auto& planes = outputs[1].shape;
  const bool as_declared = rows.size() == 3 && rows[0] == 1 && planes.size() == 4 && planes[0] == 1 &&
                           rows[1] == 4 + output.classes + output.coefficients &&
                           planes[1] == output.coefficients;
  if (!as_declared) {
    throw UserError(fmt::format("'{}' gives {}, {}, which is not what it declares; export it anew",
                                model_.file().string(), describe({"output0", "float32", rows}),
                                describe({"output1", "float32", planes})));
  }
  output.channels = outputs[0].data;
  output.prototypes = outputs[1].data;
  output.anchors = static_cast<int>(rows[2]);
  output.prototype_size = {static_cast<int>(planes[3]), static_cast<int>(planes[2])};
  return output;
}

std::vector<Instance> YoloSegmenter::decode(const YoloOutput& output, const Letterbox& letterbox) const {
  const std::vector<Detection> detections =
      suppress_overlaps(find_candidates(output, static_cast<float>(options_.min_score), selected_),
                        static_cast<float>(options_.nms_iou), options_.max_instances);
  std::vector<Instance> instances;
  for (const Detection& detection : detections) {
    const cv::Rect box = image_box(detection, letterbox);
    BitMask mask = decode_mask(output, detection, box, letterbox);
    if (mask.none()) continue;
    const auto class_index = static_cast<std::size_t>(detection.class_index);
    instances.push_back({class_names_[class_index], detection.score, box, std::move(mask)});
  }
  return instances;
}

}  // namespace ipl_slam
