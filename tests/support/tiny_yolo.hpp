#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "support/onnx_writer.hpp"

namespace ipl_slam {

/// What tiny_yolo makes.
struct TinyYoloShape {
  std::int64_t width = 64, height = 64;  ///< of the input; -1 leaves it open
  bool prototypes = true;                ///< false: a detecting network without masks
  bool transposed = false;               ///< output0 as [1, anchors, channels]
  std::int64_t batch = 1;
};

/// A network with the inputs and outputs of a segmenting YOLOv8 export that sees one rectangle in pure red
/// (class 0, "red thing", score 0.9) or pure blue (class 1, "blue thing", 0.8) on grey. Every 8 x 8 cell of
/// the input that holds such a pixel proposes the box around all these cells; the one prototype is the share
/// of coloured pixels in 4 x 4, less a half. Returns the bytes of an ONNX file.
inline std::string tiny_yolo(const TinyYoloShape& shape = {}) {
  OnnxWriter onnx;
  const OnnxWriter::Integers scalar;
  onnx.input("images", {shape.batch, 3, shape.height, shape.width});

  onnx.constant("red filter", {1, 3, 1, 1}, std::vector<float>{1, -1, -1});
  onnx.constant("blue filter", {1, 3, 1, 1}, std::vector<float>{-1, -1, 1});
  onnx.constant("minus half", {1}, std::vector<float>{-0.5F});
  onnx.node("Conv", {"images", "red filter", "minus half"}, "red");  // 0.5 on red, -0.5 or less elsewhere
  onnx.node("Conv", {"images", "blue filter", "minus half"}, "blue");
  onnx.node("Max", {"red", "blue"}, "colored");
  onnx.node("AveragePool", {"colored"}, "output1", {{"kernel_shape", {4, 4}}, {"strides", {4, 4}}});

  onnx.constant("steep", scalar, std::vector<float>{1000});
  for (const std::string color : {"red", "blue"}) {
    onnx.node("MaxPool", {color}, color + " best", {{"kernel_shape", {8, 8}}, {"strides", {8, 8}}});
    onnx.node("Mul", {color + " best", "steep"}, color + " logit");
    onnx.node("Sigmoid", {color + " logit"}, color + " cells");  // 1 or 0
  }
  onnx.node("Max", {"red cells", "blue cells"}, "cells");
  onnx.constant("zero", scalar, std::vector<float>{0});
  onnx.constant("one", scalar, std::vector<float>{1});
  onnx.node("Mul", {"cells", "zero"}, "zeros");
  onnx.node("Add", {"zeros", "one"}, "ones");

  // Along x and y: centre and length of the box, from the first and the last cell.
  onnx.constant("far", scalar, std::vector<float>{1000});
  onnx.constant("half cell", scalar, std::vector<float>{4});
  onnx.constant("cell", scalar, std::vector<float>{8});
  for (const std::string axis : {"x", "y"}) {
    onnx.constant(axis + " axis", scalar, OnnxWriter::Integers{axis == "x" ? 3 : 2});
    onnx.node("CumSum", {"ones", axis + " axis"}, axis + " ends");
    onnx.node("Sub", {axis + " ends", "one"}, axis + " starts");
    onnx.node("Sub", {"far", axis + " starts"}, axis + " to start");
    onnx.node("Mul", {"cells", axis + " to start"}, axis + " own to start");
    onnx.node("Mul", {"cells", axis + " ends"}, axis + " own ends");
    onnx.node("ReduceMax", {axis + " own to start"}, axis + " most", {{"axes", {2, 3}}, {"keepdims", {1}}});
    onnx.node("ReduceMax", {axis + " own ends"}, axis + " last", {{"axes", {2, 3}}, {"keepdims", {1}}});
    onnx.node("Sub", {"far", axis + " most"}, axis + " first");
    onnx.node("Add", {axis + " first", axis + " last"}, axis + " sum");
    onnx.node("Mul", {axis + " sum", "half cell"}, axis + " center");
    onnx.node("Add", {axis + " center", "zeros"}, axis + " centers");
    onnx.node("Sub", {axis + " last", axis + " first"}, axis + " cells");
    onnx.node("Mul", {axis + " cells", "cell"}, axis + " length");
    onnx.node("Add", {axis + " length", "zeros"}, axis + " lengths");
  }
  onnx.constant("red sureness", scalar, std::vector<float>{0.9F});
  onnx.constant("blue sureness", scalar, std::vector<float>{0.8F});
  onnx.node("Mul", {"red cells", "red sureness"}, "red score");
  onnx.node("Mul", {"blue cells", "blue sureness"}, "blue score");
  onnx.node("Concat", {"x centers", "y centers", "x lengths", "y lengths", "red score", "blue score", "ones"},
            "per cell", {{"axis", {1}}});
  onnx.constant("rows", {3}, OnnxWriter::Integers{1, 7, -1});
  onnx.node("Reshape", {"per cell", "rows"}, "channels first");
  onnx.node("Transpose", {"channels first"}, "output0",
            {{"perm", {0, shape.transposed ? 2 : 1, shape.transposed ? 1 : 2}}});

  const bool open = shape.width < 0 || shape.height < 0;
  const std::int64_t anchors = open ? -1 : shape.width * shape.height / 64;
  onnx.output("output0",
              shape.transposed ? OnnxWriter::Integers{1, anchors, 7} : OnnxWriter::Integers{1, 7, anchors});
  if (shape.prototypes) {
    onnx.output("output1", {1, 1, open ? -1 : shape.height / 4, open ? -1 : shape.width / 4});
  }
  onnx.metadata("names", "{0: 'red thing', 1: 'blue thing'}");
  return onnx.model();
}

}  // namespace ipl_slam
