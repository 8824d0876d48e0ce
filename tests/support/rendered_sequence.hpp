#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "dataset/rgbd_frame.hpp"
#include "dataset/synthetic/synthetic_source.hpp"

namespace ipl_slam::testing {

/// A walk through the built-in room, small enough to be rendered and tracked in a test.
inline SyntheticOptions small_room(int frames, const char* trajectory = "halfsphere") {
  SyntheticOptions options;
  options.trajectory = trajectory;
  options.frames = frames;
  options.width = 320;
  options.height = 240;
  return options;
}

/// The camera of small_room().
inline Camera small_camera() {
  return SyntheticSource(small_room(1)).camera();
}

/// All its frames, rendered once and kept.
inline std::vector<RgbdFrame> render_all(const SyntheticOptions& options) {
  SyntheticSource source(options, 2);
  std::vector<RgbdFrame> frames;
  while (auto item = source.next()) frames.push_back(std::move(*item->frame));
  return frames;
}

/// Frames that are there already, as a source.
class KeptFrames : public RgbdSource {
 public:
  explicit KeptFrames(std::vector<RgbdFrame> frames) : frames_(std::move(frames)) {}

  [[nodiscard]] std::optional<SourceItem> next() override {
    if (position_ == frames_.size()) return std::nullopt;
    const RgbdFrame& frame = frames_[position_++];
    return SourceItem{frame, frame.timestamp, {}, {}};
  }
  [[nodiscard]] std::size_t size() const override { return frames_.size(); }

 private:
  std::vector<RgbdFrame> frames_;
  std::size_t position_ = 0;
};

}  // namespace ipl_slam::testing
