#include "dense/view_store.hpp"

#include <stdexcept>
#include <string_view>

#include <opencv2/imgcodecs.hpp>

#include "dense/depth_codec.hpp"
#include "dense/label_codec.hpp"

namespace ipl_slam {
namespace {

// Above 90 the grain of JPEG is below that of the cameras; a cloud's colour is a mean over views besides.
constexpr int kJpegQuality = 92;

void require(bool holds, const char* what) {
  if (!holds) throw std::invalid_argument(what);
}

}  // namespace

void ViewStore::add(KeyframeId id, const DenseView& view) {
  require(view.color.size() == size_ && view.color.type() == CV_8UC3, "ViewStore: wrong colour image");
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", view.color, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  add(id, view, {jpeg.begin(), jpeg.end()});
}

void ViewStore::add(KeyframeId id, const DenseView& view, const std::string& color_jpeg) {
  require(!holds(id), "ViewStore: this keyframe is there already");
  require(view.depth.size() == size_ && view.depth.type() == CV_16UC1, "ViewStore: wrong depth image");
  require(view.labels.size() == size_ && view.labels.type() == CV_8UC1, "ViewStore: wrong label image");
  Entry entry{view.timestamp, view.instances, {}, {}, {}};
  entry.color = spool_.append(color_jpeg);
  entry.depth = spool_.append(pack_depth(view.depth));
  entry.labels = spool_.append(pack_labels(view.labels));
  entries_.emplace(id, std::move(entry));
}

std::vector<KeyframeId> ViewStore::ids() const {
  std::vector<KeyframeId> result;
  for (const auto& [id, entry] : entries_) result.push_back(id);
  return result;
}

cv::Mat ViewStore::depth(KeyframeId id) const {
  return unpack_depth(spool_.read(entry(id).depth), size_);
}

cv::Mat ViewStore::labels(KeyframeId id) const {
  return unpack_labels(spool_.read(entry(id).labels), size_);
}

cv::Mat ViewStore::color(KeyframeId id) const {
  std::string jpeg = color_jpeg(id);
  return cv::imdecode(cv::Mat(1, static_cast<int>(jpeg.size()), CV_8UC1, jpeg.data()), cv::IMREAD_COLOR);
}

std::string ViewStore::color_jpeg(KeyframeId id) const {
  return spool_.read(entry(id).color);
}

const ViewStore::Entry& ViewStore::entry(KeyframeId id) const {
  const auto found = entries_.find(id);
  require(found != entries_.end(), "ViewStore: no such keyframe");
  return found->second;
}

}  // namespace ipl_slam
