#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ipl_slam {

/// A protocol buffer message under construction.
class ProtoMessage {
 public:
  ProtoMessage& integer(unsigned field, std::int64_t value) {
    varint(std::uint64_t{field} << 3U);
    varint(static_cast<std::uint64_t>(value));
    return *this;
  }
  ProtoMessage& bytes(unsigned field, std::string_view value) {
    varint(std::uint64_t{field} << 3U | 2U);
    varint(value.size());
    data_ += value;
    return *this;
  }
  ProtoMessage& message(unsigned field, const ProtoMessage& value) { return bytes(field, value.data_); }
  [[nodiscard]] const std::string& data() const { return data_; }

 private:
  void varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7U) data_ += static_cast<char>(value | 0x80U);
    data_ += static_cast<char>(value);
  }
  std::string data_;
};

/// Writes small ONNX models. Field numbers are those of onnx.proto (https://github.com/onnx/onnx).
class OnnxWriter {
 public:
  using Integers = std::vector<std::int64_t>;
  using Attributes = std::vector<std::pair<std::string, Integers>>;

  void node(std::string_view type, const std::vector<std::string>& inputs, std::string_view output,
            const Attributes& attributes = {}) {
    ProtoMessage node;
    for (const std::string& input : inputs) node.bytes(1, input);
    node.bytes(2, output).bytes(4, type);
    for (const auto& [name, values] : attributes) node.message(5, attribute(name, values));
    graph_.message(1, node);
  }
  void constant(std::string_view name, const Integers& shape, const std::vector<float>& values) {
    constant(name, shape, 1, values.data(), values.size() * sizeof(float));
  }
  void constant(std::string_view name, const Integers& shape, const Integers& values) {
    constant(name, shape, 7, values.data(), values.size() * sizeof(std::int64_t));
  }
  /// float32; -1 leaves a size open.
  void input(std::string_view name, const Integers& shape) { graph_.message(11, value(name, shape)); }
  void output(std::string_view name, const Integers& shape) { graph_.message(12, value(name, shape)); }
  void metadata(std::string_view key, std::string_view text) {
    metadata_.message(14, ProtoMessage().bytes(1, key).bytes(2, text));
  }

  /// The bytes of the model's file.
  [[nodiscard]] std::string model(std::int64_t opset = 13) const {
    ProtoMessage graph;
    graph.bytes(2, "made for a test");
    ProtoMessage model;
    model.integer(1, 7).bytes(7, graph.data() + graph_.data());
    model.message(8, ProtoMessage().bytes(1, "").integer(2, opset));
    return model.data() + metadata_.data();
  }

 private:
  /// One value makes an INT attribute if its name is one of those that take a single number.
  static ProtoMessage attribute(const std::string& name, const Integers& values) {
    ProtoMessage message;
    message.bytes(1, name);
    if (name == "axis" || name == "keepdims") return message.integer(3, values.at(0)).integer(20, 2);
    for (const std::int64_t value : values) message.integer(8, value);
    return message.integer(20, 7);
  }
  static ProtoMessage value(std::string_view name, const Integers& shape) {
    ProtoMessage sizes;
    for (const std::int64_t size : shape) {
      sizes.message(1, size < 0 ? ProtoMessage().bytes(2, "open") : ProtoMessage().integer(1, size));
    }
    const ProtoMessage tensor = ProtoMessage().integer(1, 1).message(2, sizes);
    return ProtoMessage().bytes(1, name).message(2, ProtoMessage().message(1, tensor));
  }
  void constant(std::string_view name, const Integers& shape, std::int64_t type, const void* data,
                std::size_t size) {
    static_assert(std::endian::native == std::endian::little);
    ProtoMessage tensor;
    for (const std::int64_t length : shape) tensor.integer(1, length);
    tensor.integer(2, type).bytes(8, name).bytes(9, {static_cast<const char*>(data), size});
    graph_.message(5, tensor);
  }

  ProtoMessage graph_, metadata_;
};

}  // namespace ipl_slam
