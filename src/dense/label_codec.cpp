#include "dense/label_codec.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>

#include "dense/nibble_stream.hpp"

namespace ipl_slam {
namespace {

using Label = std::uint8_t;

// How many labels at the start are the same.
std::size_t run_length(std::span<const Label> labels) {
  constexpr std::size_t step = sizeof(std::uint64_t);
  std::uint64_t same = 0, next = 0;
  std::memset(&same, labels[0], step);
  std::size_t n = 1;
  for (; n + step <= labels.size(); n += step) {
    std::memcpy(&next, labels.data() + n, step);
    if (next != same) break;
  }
  while (n < labels.size() && labels[n] == labels[0]) ++n;
  return n;
}

}  // namespace

std::string pack_labels(const cv::Mat& labels) {
  if (labels.type() != CV_8UC1) throw std::invalid_argument("pack_labels: not CV_8UC1");
  const cv::Mat image = labels.isContinuous() ? labels : labels.clone();
  NibbleWriter out;
  for (std::span<const Label> rest(image.ptr<Label>(), image.total()); !rest.empty();) {
    const std::size_t length = run_length(rest);
    out.put_number(rest[0]);
    out.put_number(static_cast<std::uint32_t>(length - 1));
    rest = rest.subspan(length);
  }
  return out.take();
}

cv::Mat unpack_labels(std::string_view bytes, cv::Size size) {
  NibbleReader in(bytes);
  cv::Mat image(size, CV_8UC1);
  for (std::span<Label> rest(image.ptr<Label>(), image.total()); !rest.empty();) {
    const std::uint32_t label = in.get_number();
    const std::size_t length = std::size_t{in.get_number()} + 1;
    if (label > 255) throw FormatError("holds a label beyond 8 bits; make it again");
    if (length > rest.size()) throw FormatError("is not of an image of this size; make it again");
    std::fill_n(rest.begin(), length, static_cast<Label>(label));
    rest = rest.subspan(length);
  }
  in.expect_end();
  return image;
}

}  // namespace ipl_slam
