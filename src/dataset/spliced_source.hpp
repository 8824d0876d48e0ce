#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dataset/rgbd_frame.hpp"

namespace ipl_slam {

/// Plays ranges of frames of other sources one after the other, as a camera sees that is carried away
/// blindfold and put down elsewhere: a known place, then something else or nothing, then a known place again.
/// Frames are numbered anew and their times run on without a gap; origin() tells where each comes from,
/// so that true poses can be looked up.
class SplicedSource : public RgbdSource {
 public:
  /// A part of the sequence. Where it is `covered` its frames are black and without depth, as behind a
  /// covered lens.
  struct Cut {
    std::size_t source = 0;  ///< which of the sources
    std::size_t first = 0;   ///< item of that source, both ends included
    std::size_t last = 0;
    bool covered = false;
  };
  /// Where an item comes from.
  struct Origin {
    std::size_t source = 0;
    std::size_t index = 0;  ///< of the item in its source
    bool covered = false;
  };

  /// Reads what the cuts need of each source, and keeps it in memory: a cut may come again or lie before the
  /// one played last. All images must have the same size. `step` is the time between the last frame of a cut
  /// and the first of the next, seconds; within a cut frames keep their distances in time.
  /// Throws std::invalid_argument if there is no cut, a cut ends before it begins, names no source or reaches
  /// beyond the end of its source, or if step is not positive.
  SplicedSource(const std::vector<RgbdSource*>& sources, const std::vector<Cut>& cuts, double step);

  [[nodiscard]] std::optional<SourceItem> next() override;
  [[nodiscard]] std::size_t size() const override { return items_.size(); }

  /// Where item `index` of this source comes from.
  [[nodiscard]] const Origin& origin(std::size_t index) const { return origins_.at(index); }
  /// Its time in this source, seconds.
  [[nodiscard]] double timestamp(std::size_t index) const { return items_.at(index).timestamp; }

 private:
  void append(const std::vector<SourceItem>& read, const Cut& cut, double step);

  std::vector<SourceItem> items_;
  std::vector<Origin> origins_;
  std::size_t position_ = 0;
};

}  // namespace ipl_slam
