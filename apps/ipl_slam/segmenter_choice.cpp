#include "segmenter_choice.hpp"

#include <cstdlib>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "output.hpp"
#include "segmentation/make_segmenter.hpp"
#include "sequence_options.hpp"

namespace ipl_slam::cli {
namespace {

constexpr const char* kModelVariable = "IPL_SLAM_MODEL";

}  // namespace

void SegmenterChoice::add_to(CLI::App& verb) {
  verb.add_option(
          "--segmenter", segmenter,
          "Who finds the instances: yolo (needs --model), masks (needs --masks), geometric (from depth and "
          "motion alone), none, or auto (default): what --masks, --model or IPL_SLAM_MODEL ask for, else "
          "geometric")
      ->type_name("NAME")
      ->check(CLI::IsMember({"auto", "none", "yolo", "masks", "geometric"}));
  auto* model_option =
      verb.add_option("--model", model,
                      "YOLOv8-seg or YOLO11-seg network in ONNX format (default: the environment variable "
                      "IPL_SLAM_MODEL)")
          ->type_name("FILE")
          ->check(not_empty());
  verb.add_option("--masks", masks, "Folder with masks made beforehand, one label image per frame")
      ->type_name("FOLDER")
      ->check(not_empty())
      ->excludes(model_option);
}

std::string SegmenterChoice::resolve(Config& config) const {
  SegmentationOptions& options = config.segmentation;
  if (!segmenter.empty()) options.segmenter = segmenter;
  for (const auto& [file, name, target] :
       {std::tuple(model, "yolo", &options.yolo.model), std::tuple(masks, "masks", &options.masks.folder)}) {
    if (file.empty()) continue;
    if (segmenter.empty() || segmenter == "auto") options.segmenter = name;
    if (options.segmenter != name) {
      throw UserError(fmt::format("--segmenter {} does not use '{}'; leave one of the two out", segmenter,
                                  file.string()));
    }
    *target = file.string();
  }
  const char* variable = std::getenv(kModelVariable);
  const bool may_be_yolo =
      options.segmenter == "yolo" || (options.segmenter == "auto" && options.masks.folder.empty());
  const bool from_variable = variable != nullptr && may_be_yolo && options.yolo.model.empty();
  if (from_variable) options.yolo.model = variable;
  options.segmenter = chosen_segmenter(options);
  if (options.segmenter == "yolo")
    return fmt::format("yolo ({}{})", options.yolo.model, from_variable ? ", from IPL_SLAM_MODEL" : "");
  if (options.segmenter == "masks") return fmt::format("masks ({})", options.masks.folder);
  return options.segmenter;
}

void SegmenterChoice::apply(Config& config) const {
  const std::string chosen = resolve(config);
  if (says_remarks()) fmt::print("segmenter: {}\n", chosen);
}

}  // namespace ipl_slam::cli
