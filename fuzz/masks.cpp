// What stands beside the pictures in a folder of masks: the input is the list of masks, the names of classes
// and the objects of a picture at once.
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "segmentation/class_names.hpp"
#include "segmentation/mask_folder_segmenter.hpp"
#include "user_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ipl_slam;
  constexpr int kSide = 8;
  static const std::filesystem::path folder = [] {
    const auto file = fuzz::user_file("list/1.0.png", nullptr, 0);
    cv::Mat labels(kSide, kSide, CV_8UC1, cv::Scalar(1));
    cv::imwrite(file.string(), labels);
    return file.parent_path();
  }();
  (void)fuzz::user_file("list/classes.txt", data, size);
  (void)fuzz::user_file("list/objects.json", data, size);
  const MaskFolderOptions options{.folder = folder.string(), .min_area = 1};
  RgbdFrame frame;
  frame.timestamp = 1.0;
  fuzz::read_or_refuse([&] { (void)MaskFolderSegmenter(options, {kSide, kSide}).segment(frame); });
  std::filesystem::remove(folder / "classes.txt");  // what it refuses hides the objects
  fuzz::read_or_refuse([&] { (void)MaskFolderSegmenter(options, {kSide, kSide}).segment(frame); });
  fuzz::read_or_refuse([&] { (void)parse_class_names({reinterpret_cast<const char*>(data), size}); });
  return 0;
}
