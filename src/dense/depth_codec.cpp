#include "dense/depth_codec.hpp"

#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "dense/nibble_stream.hpp"

namespace ipl_slam {
namespace {

using Depth = std::uint16_t;
constexpr std::size_t kDepths = std::size_t{1} << 16;

constexpr unsigned kSingle = 9;   // nibbles from here on hold one difference
constexpr unsigned kEscape = 15;  // the difference follows as a number
constexpr unsigned kEscaped = kEscape - kSingle;

std::uint32_t zigzag(int difference) {
  return (static_cast<std::uint32_t>(difference) << 1) ^ static_cast<std::uint32_t>(difference >> 31);
}

int undo_zigzag(std::uint32_t value) {
  return static_cast<int>(value >> 1) ^ -static_cast<int>(value & 1);
}

std::span<const Depth> pixels(const cv::Mat& image) {
  return {image.ptr<Depth>(), image.total()};
}

// Writes the depths that occur, and gives the rank of each.
std::vector<Depth> put_values(std::span<const Depth> depth, NibbleWriter& out) {
  std::vector<std::uint8_t> occurs(kDepths);
  for (const Depth d : depth) occurs[d] = 1;
  std::vector<Depth> rank(kDepths), values;
  for (std::size_t d = 1; d < kDepths; ++d) {
    if (occurs[d] == 0) continue;
    rank[d] = static_cast<Depth>(values.size());
    values.push_back(static_cast<Depth>(d));
  }
  out.put_number(static_cast<std::uint32_t>(values.size()));
  Depth before = 0;
  for (const Depth value : values) {
    out.put_number(value - before - 1U);
    before = value;
  }
  return rank;
}

std::vector<Depth> get_values(NibbleReader& in) {
  const std::uint32_t count = in.get_number();
  if (count >= kDepths) throw FormatError("holds too many different depths; make it again");
  std::vector<Depth> values(count);
  std::uint32_t value = 0;
  for (Depth& v : values) {
    value += in.get_number() + 1;
    if (value >= kDepths) throw FormatError("holds a depth beyond 16 bits; make it again");
    v = static_cast<Depth>(value);
  }
  return values;
}

void put_single(int difference, NibbleWriter& out) {
  const std::uint32_t value = zigzag(difference);
  if (value < kEscaped) {
    out.put(kSingle + value);
  } else {
    out.put(kEscape);
    out.put_number(value - kEscaped);
  }
}

// A run of depths without zeros. `before` is the rank before it, and then that of its last pixel.
void put_run(std::span<const Depth> run, const std::vector<Depth>& rank, int& before, NibbleWriter& out) {
  std::size_t i = 0;
  while (i < run.size()) {
    const int first = rank[run[i]], d1 = first - before;
    before = first;
    ++i;
    if (i < run.size() && d1 >= -1 && d1 <= 1) {
      const int second = rank[run[i]], d2 = second - before;
      if (d2 >= -1 && d2 <= 1) {
        out.put(static_cast<unsigned>(3 * (d1 + 1) + d2 + 1));
        before = second;
        ++i;
        continue;
      }
    }
    put_single(d1, out);
  }
}

/// Ranks turned back into depths.
class Ranks {
 public:
  explicit Ranks(std::vector<Depth> values) : values_(std::move(values)) {}

  Depth next(int difference) {
    // Unsigned, so that no sum overflows; below 0 is then far above the last.
    rank_ += static_cast<std::uint32_t>(difference);
    if (rank_ >= values_.size()) throw FormatError("holds a depth that it does not list; make it again");
    return values_[rank_];
  }

 private:
  std::vector<Depth> values_;
  std::uint32_t rank_ = 0;
};

void get_run(NibbleReader& in, Ranks& ranks, std::span<Depth> run) {
  std::size_t i = 0;
  while (i < run.size()) {
    const unsigned nibble = in.get();
    if (nibble < kSingle) {
      if (run.size() - i < 2) throw FormatError("holds a run that is too long; make it again");
      run[i++] = ranks.next(static_cast<int>(nibble / 3) - 1);
      run[i++] = ranks.next(static_cast<int>(nibble % 3) - 1);
    } else {
      run[i++] = ranks.next(undo_zigzag(nibble == kEscape ? in.get_number() + kEscaped : nibble - kSingle));
    }
  }
}

}  // namespace

std::string pack_depth(const cv::Mat& depth) {
  if (depth.type() != CV_16UC1) throw std::invalid_argument("pack_depth: not CV_16UC1");
  const cv::Mat image = depth.isContinuous() ? depth : depth.clone();
  const std::span<const Depth> all = pixels(image);
  NibbleWriter out;
  const std::vector<Depth> rank = put_values(all, out);
  int before = 0;
  for (std::size_t at = 0; at < all.size();) {
    std::size_t begin = at;
    while (begin < all.size() && all[begin] == 0) ++begin;
    std::size_t end = begin;
    while (end < all.size() && all[end] != 0) ++end;
    out.put_number(static_cast<std::uint32_t>(begin - at));
    out.put_number(static_cast<std::uint32_t>(end - begin));
    put_run(all.subspan(begin, end - begin), rank, before, out);
    at = end;
  }
  return out.take();
}

cv::Mat unpack_depth(std::string_view bytes, cv::Size size) {
  NibbleReader in(bytes);
  Ranks ranks(get_values(in));
  cv::Mat image = cv::Mat::zeros(size, CV_16UC1);
  std::span<Depth> rest(image.ptr<Depth>(), image.total());
  while (!rest.empty()) {
    const std::size_t zeros = in.get_number();
    const std::size_t depths = in.get_number();
    if (zeros + depths > rest.size() || zeros + depths == 0) {
      throw FormatError("is not of an image of this size; make it again");
    }
    get_run(in, ranks, rest.subspan(zeros, depths));
    rest = rest.subspan(zeros + depths);
  }
  in.expect_end();
  return image;
}

}  // namespace ipl_slam
