#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "common/ids.hpp"
#include "dense/byte_spool.hpp"
#include "dense/dense_view.hpp"

namespace ipl_slam {

/// The views of the keyframes, packed and on the disk (ByteSpool): depth and labels without loss, colour as
/// JPEG. Some 150 kB a view of 640 x 480; in memory there is only what is listed of them. Used by one thread
/// at a time.
///
/// Asking for a view that is not there is a std::invalid_argument. Throws UserError where the disk fails.
class ViewStore {
 public:
  /// image_size: of all views.
  explicit ViewStore(cv::Size image_size) : size_(image_size) {}

  void add(KeyframeId id, const DenseView& view);
  /// The same with colour that is a JPEG file already; view.color does not count.
  void add(KeyframeId id, const DenseView& view, const std::string& color_jpeg);

  [[nodiscard]] cv::Size image_size() const { return size_; }
  [[nodiscard]] bool holds(KeyframeId id) const { return entries_.contains(id); }
  /// Increasing.
  [[nodiscard]] std::vector<KeyframeId> ids() const;

  [[nodiscard]] double timestamp(KeyframeId id) const { return entry(id).timestamp; }
  [[nodiscard]] const std::vector<ViewInstance>& instances(KeyframeId id) const {
    return entry(id).instances;
  }
  [[nodiscard]] cv::Mat depth(KeyframeId id) const;
  [[nodiscard]] cv::Mat labels(KeyframeId id) const;
  /// CV_8UC3 (BGR).
  [[nodiscard]] cv::Mat color(KeyframeId id) const;
  /// The bytes of the JPEG file.
  [[nodiscard]] std::string color_jpeg(KeyframeId id) const;

  /// On the disk.
  [[nodiscard]] std::size_t bytes() const { return spool_.bytes(); }

 private:
  struct Entry {
    double timestamp = 0.0;
    std::vector<ViewInstance> instances;
    ByteSpool::Slot color, depth, labels;
  };
  [[nodiscard]] const Entry& entry(KeyframeId id) const;

  cv::Size size_;
  ByteSpool spool_;
  std::map<KeyframeId, Entry> entries_;
};

}  // namespace ipl_slam
