#pragma once

#include <string>

namespace ipl_slam {

/// Some converters write `Softmax` over axis 1 as opset 13 defines it (over that axis alone) into models that
/// declare opset 11 or 12, where it runs over axis 1 and all axes after it together. OpenCV reads such a file
/// as it was meant; ONNX Runtime follows the standard, and all boxes of a YOLO network come out without width
/// and height. No exporter that follows the old rule has a use for such a node in a YOLO network: the
/// distribution over box sides and attention are brought to the last axis first.
///
/// Declares such a model (the bytes of its file) to be of opset 13 and returns true. Leaves any other one as
/// it is, also one with operators that differ in opset 13, and bytes that are no model.
bool mend_softmax_opset(std::string& model);

}  // namespace ipl_slam
