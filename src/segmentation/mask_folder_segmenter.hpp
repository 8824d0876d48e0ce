#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/options.hpp"
#include "dataset/association.hpp"
#include "dataset/image_list.hpp"
#include "segmentation/segmenter.hpp"

namespace ipl_slam {

/// Where precomputed masks lie and which of them count.
struct MaskFolderOptions {
  std::string folder;
  double max_difference = kAssociationWindow;  ///< between a colour image and its mask, s
  int min_area = 50;  ///< smaller instances hold hardly a feature and are left out, pixels

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("folder", folder, "folder with one label image per frame; relative to the working directory");
    v.number("max_difference", max_difference,
             {1e-6, 1.0, "s", "a mask this far in time from the colour image, or further, is not its mask"});
    v.number("min_area", min_area, {1, 1e9, "pixel", "instances smaller than this are left out"});
  }
};

/// Instance masks made beforehand by any program, e.g. SAM, Mask R-CNN, or the ground truth of a rendered
/// sequence. The folder holds
/// - label images, PNG with one channel of 8 or 16 bits: a pixel's value is the id of its instance, 0 = none;
/// - masks.txt, lines "timestamp file" (relative to the folder), as `ipl_slam synth` writes it; without it
///   the images are named by their timestamps, e.g. 1305031102.175304.png;
/// - optionally what the ids mean: classes.txt with lines "ID CLASS [SCORE]" and '#' comments, or
///   objects.json as `ipl_slam synth` writes it; also in the folder above, where masks.txt is there. The
///   score is the last word if that is a number with a decimal point, from 0.0 to 1.0, and no other word is;
///   so "3 class 7" has none and "3 class 7 0.9" has one;
/// - optionally the same for one image alone, for segmenters that count anew in every frame: a file beside
///   the image with the ending .txt. It then counts instead of the folder's list.
/// An id that no list names is an instance of class "unknown" with score 1.
class MaskFolderSegmenter : public Segmenter {
 public:
  /// image_size: of the sequence. Reads the lists and the first image that can be read. Throws UserError for
  /// a folder that is no folder of masks for this sequence: missing, without images, none of which can be
  /// read, or not of this kind or size; and for a broken list.
  MaskFolderSegmenter(const MaskFolderOptions& options, cv::Size image_size);

  /// Best score first, then by id. Frames may come in any order. No instances where the frame's mask is
  /// missing or broken.
  [[nodiscard]] std::vector<Instance> segment(const RgbdFrame& frame) override;
  [[nodiscard]] std::string name() const override { return "masks"; }
  /// How many frames had no mask, and how many one that could not be used, with what is wrong with the last.
  [[nodiscard]] std::vector<std::string> remarks() const override;

 private:
  struct ClassScore {
    std::string class_name = "unknown";
    float score = 1.0F;
  };
  using ClassList = std::map<int, ClassScore>;  // by id

  [[nodiscard]] static ClassList read_classes(const std::filesystem::path& file);
  [[nodiscard]] static ClassList read_objects(const std::filesystem::path& file);
  [[nodiscard]] const ListedImage* nearest(double timestamp) const;
  [[nodiscard]] std::vector<Instance> instances(const cv::Mat& labels, const ClassList& classes) const;
  std::vector<Instance> broken_file(const std::string& problem);

  std::filesystem::path folder_;
  MaskFolderOptions options_;
  cv::Size image_size_;
  std::vector<ListedImage> images_;  // in order of time
  ClassList classes_;
  std::size_t frames_ = 0, missing_ = 0, broken_ = 0;
  std::string last_problem_;
};

}  // namespace ipl_slam
