#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "segmentation/onnx_model.hpp"
#include "segmentation/segmenter.hpp"
#include "segmentation/yolo_output.hpp"

namespace ipl_slam {

/// Settings of the YOLO segmenter.
struct YoloOptions {
  std::string model;    ///< ONNX file
  std::string classes;  ///< names of those to keep, separated by commas; empty = all
  double min_score =
      0.25;  ///< Ultralytics' default; of 0.25 to 0.35 the one that finds most at hardly more error
  double nms_iou = 0.7;     ///< Ultralytics' default for prediction
  int max_instances = 100;  ///< per image, the best
  /// Pixels of the longer side of the image in the network's input. At 640, as the networks were trained,
  /// people who fill much of the picture are overlooked more often than at 320 (measured: 71 against 86 % of
  /// their pixels found), and those some metres away are found at both.
  int image_side = 320;
  int threads = 1;  ///< that work on one image

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("model", model, "segmenting YOLOv8 or YOLO11 network in ONNX format, as Ultralytics exports it");
    v.text("classes", classes, "names of the classes to keep, separated by commas; empty keeps all");
    v.number("min_score", min_score, {0.01, 1.0, "", "instances with a lower score are left out"});
    v.number("nms_iou", nms_iou,
             {0.0, 1.0, "", "of two boxes of one class that overlap more only the better one stays"});
    v.number("max_instances", max_instances, {1, 250, "count", "most instances kept per image"});
    v.number(
        "image_side", image_side,
        {64, 4096, "pixel",
         "the longer side of the picture when the network sees it; a model of open input size then takes no "
         "more than that, one of fixed size sees it padded"});
    v.number("threads", threads, {1, 64, "count", "threads that work on one image"});
  }
};

/// How long the parts of one call took, ms.
struct YoloTimes {
  double preprocess = 0.0;   ///< scaling the image into the network's input
  double inference = 0.0;    ///< the network itself
  double postprocess = 0.0;  ///< candidates, suppression, masks
};

/// Instances by a YOLOv8-seg or YOLO11-seg network (Jocher et al., Ultralytics) in an unmodified ONNX export:
/// one float32 input [1, 3, H, W], two outputs [1, 4 + classes + coefficients, anchors] and
/// [1, coefficients, H/4, W/4], of fixed or open H and W. Needs no depth, remembers nothing between images.
class YoloSegmenter : public Segmenter {
 public:
  /// Loads the model. Throws UserError: no model given, a file that is missing or no such network (the
  /// message says what was expected and found), a class it does not know, an input size it cannot take, a
  /// build without ONNX Runtime.
  explicit YoloSegmenter(const YoloOptions& options);

  [[nodiscard]] std::vector<Instance> segment(const RgbdFrame& frame) override;
  [[nodiscard]] std::string name() const override { return "yolo"; }
  [[nodiscard]] std::vector<std::string> remarks() const override;

  /// Of the last call.
  [[nodiscard]] const YoloTimes& times() const { return times_; }
  /// The size of the network's input for an image of this size.
  [[nodiscard]] cv::Size input_size(cv::Size image) const;
  /// In the order of the network's own numbers.
  [[nodiscard]] const std::vector<std::string>& class_names() const { return class_names_; }

 private:
  [[nodiscard]] double max_scale(cv::Size image) const;
  [[nodiscard]] YoloOutput run(cv::Size input);
  [[nodiscard]] std::vector<Instance> decode(const YoloOutput& output, const Letterbox& letterbox) const;

  YoloOptions options_;
  OnnxModel model_;
  YoloOutput layout_;  ///< classes and coefficients
  std::vector<std::string> class_names_;
  std::vector<bool> selected_;
  std::vector<float> planes_;
  cv::Size image_;  ///< of the last call
  YoloTimes times_;
};

}  // namespace ipl_slam
