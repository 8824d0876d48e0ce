// The index of a folder of keyframes, beside images that are good; and what is packed like the depth and the
// labels of a view.
#include "dense/keyframe_folder.hpp"

#include <opencv2/core.hpp>

#include "common/byte_stream.hpp"
#include "dense/depth_codec.hpp"
#include "dense/label_codec.hpp"
#include "user_file.hpp"

namespace {

const cv::Size kSize(16, 16);

template <class Unpack>
void unpack_or_refuse(const Unpack& unpack) {
  try {
    unpack();
  } catch (const ipl_slam::FormatError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ipl_slam;
  static const std::filesystem::path folder = [] {
    ViewStore store(kSize);
    DenseView view;
    view.timestamp = 1.0;
    view.color = cv::Mat(kSize, CV_8UC3, cv::Scalar(1, 2, 3));
    view.depth = cv::Mat(kSize, CV_16UC1, cv::Scalar(5000));
    view.labels = cv::Mat(kSize, CV_8UC1, cv::Scalar(1));
    view.instances = {{InstanceId{1}, "person", 0.5F}};
    store.add(KeyframeId{1}, view);
    const auto made = fuzz::user_file("keyframes/made", nullptr, 0).parent_path();
    write_keyframe_folder(made, store, {{KeyframeId{1}, {}}}, Camera{});
    return made;
  }();
  (void)fuzz::user_file("keyframes/keyframes.json", data, size);
  fuzz::read_or_refuse([&] {
    ViewStore store(kSize);
    (void)read_keyframe_folder(folder, store);
  });
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  unpack_or_refuse([&] { (void)unpack_depth(bytes, kSize); });
  unpack_or_refuse([&] { (void)unpack_labels(bytes, kSize); });
  return 0;
}
