#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// One colour image with the depth image registered to it. Copies share the pixels, and stages may keep
/// copies: once a frame was handed on its pixels must not be written to.
struct RgbdFrame {
  std::size_t index = 0;   ///< position in the source, counting skipped frames
  double timestamp = 0.0;  ///< seconds; strictly increasing within a source
  cv::Mat color;           ///< CV_8UC3 (BGR) or CV_8UC1
  cv::Mat depth;  ///< CV_16UC1, raw units (Camera::depth_scale per metre), 0 = no depth, same size as color
};

/// What a source gives for one position: a frame, or why there is none.
struct SourceItem {
  std::optional<RgbdFrame> frame;
  double timestamp = 0.0;   ///< of the frame or of the frame that was skipped
  std::string skip_reason;  ///< short and countable where frame is empty, e.g. "unreadable color image"
  std::string detail;       ///< the file concerned and what is wrong with it
};

/// A sequence of frames. Sources never throw for a single broken frame: they report it as skipped.
class RgbdSource {
 public:
  virtual ~RgbdSource() = default;
  /// The next item, or nothing at the end.
  [[nodiscard]] virtual std::optional<SourceItem> next() = 0;
  /// Number of items, 0 where it is not known.
  [[nodiscard]] virtual std::size_t size() const = 0;
};

}  // namespace ipl_slam
