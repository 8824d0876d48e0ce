#include "segmentation/onnx_softmax.hpp"

#include <gtest/gtest.h>

#include "support/onnx_writer.hpp"

namespace ipl_slam {
namespace {

std::string softmax_model(std::int64_t axis, std::int64_t opset, const std::string& other = "Identity") {
  OnnxWriter onnx;
  onnx.input("in", {1, 2, 3, 4});
  onnx.node("Softmax", {"in"}, "middle", {{"axis", {axis}}});
  onnx.node(other, {"middle"}, "out");
  onnx.output("out", {1, 2, 3, 4});
  return onnx.model(opset);
}

TEST(MendSoftmaxOpset, DeclaresOpset13WhereSoftmaxRunsOverAxisOne) {
  for (const int opset : {11, 12}) {
    std::string model = softmax_model(1, opset);
    EXPECT_TRUE(mend_softmax_opset(model));
    EXPECT_EQ(model, softmax_model(1, 13));
  }
}

TEST(MendSoftmaxOpset, LeavesOtherModelsAlone) {
  for (std::string model : {softmax_model(3, 12), softmax_model(1, 13), softmax_model(1, 9),
                            softmax_model(1, 12, "Squeeze"), std::string(), std::string("no model"),
                            std::string(100, '\xff'), softmax_model(1, 12).substr(0, 20)}) {
    const std::string before = model;
    EXPECT_FALSE(mend_softmax_opset(model));
    EXPECT_EQ(model, before);
  }
}

}  // namespace
}  // namespace ipl_slam
