#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/options.hpp"
#include "dataset/association.hpp"
#include "dataset/image_list.hpp"
#include "dataset/rgbd_frame.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

struct TumDatasetOptions {
  double max_difference = kAssociationWindow;  ///< between a colour and its depth image, s
  std::string associations;  ///< file with ready pairs, absolute or in the sequence's folder; empty: rgb.txt,
                             ///< depth.txt

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_difference", max_difference,
             {1e-6, 1.0, "s", "colour and depth images further apart in time are not paired"});
    v.text("associations", associations,
           "file with colour-depth pairs to use instead of rgb.txt and depth.txt; relative to the sequence's "
           "folder");
  }
};

/// A sequence in the layout of the TUM RGB-D benchmark (Sturm et al., IROS 2012): rgb.txt and depth.txt,
/// paired by `associate`; or an associations file, where one is asked for or the lists are missing
/// (associations.txt, associate.txt). Colour images without a partner in depth are not part of the sequence;
/// unpaired_color() counts them.
///
/// What next() reports as skipped, with these reasons ("color" may be "depth" in each):
/// - "missing color image", "truncated color image", "unreadable color image"
/// - "color image not 8-bit", "depth image not 16-bit" (a colour or alpha channel in depth counts as that,
/// too)
/// - "wrong image size": the colour image has not the camera's size
/// - "color and depth differ in size"
/// - "duplicate timestamp", "backward timestamp": an entry of a list that does not come after the one before
/// it
class TumDataset : public RgbdSource {
 public:
  /// Reads the lists, no image yet. Throws UserError: missing folder, missing or empty lists, a line that
  /// cannot be parsed (file and line), no pair within the window (with both lists' ranges of time).
  TumDataset(const std::filesystem::path& folder, const Camera& camera,
             const TumDatasetOptions& options = {});

  [[nodiscard]] std::optional<SourceItem> next() override;
  [[nodiscard]] std::size_t size() const override { return entries_.size(); }

  /// groundtruth.txt of the sequence where there is one.
  [[nodiscard]] std::optional<std::filesystem::path> ground_truth() const;
  /// Images of the lists that have no partner within the window.
  [[nodiscard]] std::size_t unpaired_color() const { return unpaired_color_; }
  [[nodiscard]] std::size_t unpaired_depth() const { return unpaired_depth_; }

 private:
  /// One position of the sequence: a pair, or an entry that is misplaced in time.
  struct Entry {
    double order = 0.0;  ///< latest timestamp up to here, by which the two kinds are merged
    ListedPair pair;
    std::optional<MisplacedEntry> misplaced;
  };

  void use_lists(const std::filesystem::path& rgb, const std::filesystem::path& depth, double max_difference);
  void use_associations(const std::filesystem::path& list);
  void add_misplaced(const std::vector<MisplacedEntry>& misplaced);
  [[nodiscard]] SourceItem load(const ListedPair& pair, std::size_t index) const;

  std::filesystem::path folder_;
  Camera camera_;
  std::vector<Entry> entries_;
  std::size_t position_ = 0;
  std::size_t unpaired_color_ = 0, unpaired_depth_ = 0;
};

}  // namespace ipl_slam
