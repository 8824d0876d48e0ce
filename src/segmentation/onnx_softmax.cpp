#include "segmentation/onnx_softmax.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace ipl_slam {
namespace {

// Field numbers of the messages in onnx.proto, https://github.com/onnx/onnx
namespace model_field {
constexpr std::uint64_t kGraph = 7, kOpsetImport = 8;
}
namespace opset_field {
constexpr std::uint64_t kDomain = 1, kVersion = 2;
}
namespace graph_field {
constexpr std::uint64_t kNode = 1;
}
namespace node_field {
constexpr std::uint64_t kOperator = 4, kAttribute = 5;
}
namespace attribute_field {
constexpr std::uint64_t kName = 1, kInteger = 3;
}

/// Reads a protocol buffer message field by field.
class FieldReader {
 public:
  explicit FieldReader(std::string_view message) : rest_(message) {}

  std::uint64_t number = 0;   ///< of the field
  std::uint64_t integer = 0;  ///< its value, if it is an integer
  std::string_view bytes;     ///< its value as it stands in the file, without number and length

  /// Goes on to the next field; false at the end and where the message is broken.
  bool next() {
    const auto key = varint();
    if (!key) return false;
    number = *key >> 3U;
    integer = 0;
    switch (*key & 7U) {
      case 0: {
        const std::string_view before = rest_;
        const auto value = varint();
        if (!value) return false;
        integer = *value;
        bytes = before.substr(0, before.size() - rest_.size());
        return true;
      }
      case 1:
        return take(8);
      case 2: {
        const auto length = varint();
        return length && take(*length);
      }
      case 5:
        return take(4);
      default:
        return false;
    }
  }

 private:
  std::optional<std::uint64_t> varint() {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 10 && i < rest_.size(); ++i) {
      const auto byte = static_cast<unsigned char>(rest_[i]);
      value |= static_cast<std::uint64_t>(byte & 0x7FU) << (7 * i);
      if (byte < 0x80) {
        rest_.remove_prefix(i + 1);
        return value;
      }
    }
    return std::nullopt;
  }

  bool take(std::uint64_t length) {
    if (length > rest_.size()) return false;
    bytes = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return true;
  }

  std::string_view rest_;
};

/// The value of the last field of a number, as protocol buffers have it.
std::string_view field(std::string_view message, std::uint64_t number) {
  std::string_view found;
  for (FieldReader reader(message); reader.next();) {
    if (reader.number == number) found = reader.bytes;
  }
  return found;
}

bool has_axis_one(std::string_view node) {
  for (FieldReader reader(node); reader.next();) {
    if (reader.number != node_field::kAttribute || field(reader.bytes, attribute_field::kName) != "axis")
      continue;
    return field(reader.bytes, attribute_field::kInteger) == "\x01";
  }
  return false;
}

/// Whether all of a graph means the same in opsets 11 to 13, but for a Softmax over axis 1, which it has.
bool only_softmax_differs(std::string_view graph) {
  // Their axes are an attribute before opset 13, an input from then on.
  constexpr std::array<std::string_view, 4> kChanged = {"ReduceSum", "Split", "Squeeze", "Unsqueeze"};
  bool softmax = false;
  for (FieldReader reader(graph); reader.next();) {
    if (reader.number != graph_field::kNode) continue;
    const std::string_view name = field(reader.bytes, node_field::kOperator);
    if (std::find(kChanged.begin(), kChanged.end(), name) != kChanged.end()) return false;
    softmax = softmax || (name == "Softmax" && has_axis_one(reader.bytes));
  }
  return softmax;
}

}  // namespace

bool mend_softmax_opset(std::string& model) {
  if (!only_softmax_differs(field(model, model_field::kGraph))) return false;
  for (FieldReader reader(model); reader.next();) {
    if (reader.number != model_field::kOpsetImport) continue;
    const std::string_view domain = field(reader.bytes, opset_field::kDomain);
    const std::string_view version = field(reader.bytes, opset_field::kVersion);
    const bool standard = domain.empty() || domain == "ai.onnx";
    if (!standard || (version != "\x0b" && version != "\x0c")) continue;
    model[static_cast<std::size_t>(version.data() - model.data())] = '\x0d';
    return true;
  }
  return false;
}

}  // namespace ipl_slam
