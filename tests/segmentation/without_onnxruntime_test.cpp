// The yolo segmenter as it is in a build without ONNX Runtime: this program takes onnx_model_missing.cpp,
// whatever the library was built with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"
#include "segmentation/yolo_segmenter.hpp"
#include "support/tiny_yolo.hpp"

namespace ipl_slam {
namespace {

TEST(WithoutOnnxRuntime, TheYoloSegmenterSaysHowToGetIt) {
  ASSERT_FALSE(has_onnx_runtime());
  const testing::TemporaryFolder folder;
  YoloOptions options;
  options.model = folder.write("model.onnx", tiny_yolo()).string();
  try {
    const YoloSegmenter segmenter(options);
    FAIL() << "a segmenter was made";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(),
                ::testing::HasSubstr("this build has no YOLO segmenter: ONNX Runtime was not found"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("./dev build"));
  }
}

}  // namespace
}  // namespace ipl_slam
