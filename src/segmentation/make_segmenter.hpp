#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/options.hpp"
#include "geometry/camera.hpp"
#include "segmentation/geometric_segmenter.hpp"
#include "segmentation/mask_folder_segmenter.hpp"
#include "segmentation/segmenter.hpp"
#include "segmentation/yolo_segmenter.hpp"

namespace ipl_slam {

struct SegmentationOptions {
  std::string segmenter = "auto";
  int every = 1;
  double miss_rate = 0.0;
  YoloOptions yolo;
  MaskFolderOptions masks;
  GeometricOptions geometric;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice(
        "segmenter", segmenter, {"auto", "none", "yolo", "masks", "geometric"},
        "who finds the instances; auto: masks where masks.folder is given, else yolo where yolo.model is, "
        "else geometric");
    v.number("every", every,
             {1, 1000, "frames",
              "lockstep: every so many frames are segmented, the masks are carried over those between; in "
              "realtime the segmenter takes the newest frame whenever it is ready"});
    v.number(
        "miss_rate", miss_rate,
        {0.0, 1.0, "share",
         "for tests: this share of the detections is forgotten at random, as if the segmenter had missed "
         "them"});
    v.section("yolo", yolo, "a YOLOv8-seg or YOLO11-seg network");
    v.section("masks", masks, "masks made beforehand");
    v.section("geometric", geometric, "what does not move with the camera, by depth; needs no network");
  }
};

/// The segmenter that "auto" stands for, or the one that is named.
[[nodiscard]] std::string chosen_segmenter(const SegmentationOptions& options);
/// Null for "none". Every random choice depends on `seed`. Throws UserError as the segmenters' constructors
/// do.
[[nodiscard]] std::unique_ptr<Segmenter> make_segmenter(const SegmentationOptions& options,
                                                        const Camera& camera, std::uint64_t seed = 0);

}  // namespace ipl_slam
