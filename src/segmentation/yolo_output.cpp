#include "segmentation/yolo_output.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ipl_slam {
namespace {

/// Where a pixel's centre lies among the centres of the prototype's pixels, along one axis: between `index`
/// and the next one, `weight` of the way on.
struct Sample {
  int index = 0;
  float weight = 0.0F;
};

/// The samples of the image pixels [first, first + count). Beyond the outermost centres the outermost value
/// holds.
std::vector<Sample> samples(int first, int count, double scale, double offset, double prototype_per_input,
                            int prototype_length) {
  std::vector<Sample> samples(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double input = (first + i + 0.5) * scale + offset;
    const double position =
        std::clamp(input * prototype_per_input - 0.5, 0.0, static_cast<double>(prototype_length - 1));
    const int index = std::min(static_cast<int>(position), std::max(0, prototype_length - 2));
    samples[static_cast<std::size_t>(i)] = {index, static_cast<float>(position - index)};
  }
  return samples;
}

/// The weighted sum of the prototypes over a part of them, row by row.
std::vector<float> weighted_sum(const YoloOutput& output, int anchor, const cv::Rect& part) {
  const auto width = static_cast<std::size_t>(part.width);
  std::vector<float> sum(width * static_cast<std::size_t>(part.height), 0.0F);
  for (int k = 0; k < output.coefficients; ++k) {
    const float coefficient = output.channel(4 + output.classes + k)[anchor];
    for (int y = 0; y < part.height; ++y) {
      const float* in = output.prototype(k) +
                        static_cast<std::ptrdiff_t>(part.y + y) * output.prototype_size.width + part.x;
      float* out = sum.data() + static_cast<std::size_t>(y) * width;
      for (std::size_t x = 0; x < width; ++x) out[x] += coefficient * in[x];
    }
  }
  return sum;
}

/// Switches on the pixels from `first` on, one per sample, where the interpolated line of values is positive.
/// The line starts at prototype column `line_start`, `words` is the row of a mask. One word after the other,
/// without branches.
void set_positive(const std::vector<float>& line, int line_start, const std::vector<Sample>& columns,
                  int first, std::uint64_t* words) {
  const int count = static_cast<int>(columns.size());
  for (int i = 0; i < count;) {
    const int word = (first + i) / 64;
    const int end = std::min(count, 64 * (word + 1) - first);
    std::uint64_t bits = 0;
    for (int shift = (first + i) % 64; i < end; ++i, ++shift) {
      const Sample& column = columns[static_cast<std::size_t>(i)];
      const float* pair = line.data() + (column.index - line_start);
      const bool positive = pair[0] + column.weight * (pair[1] - pair[0]) > 0.0F;
      bits |= static_cast<std::uint64_t>(positive) << shift;
    }
    words[word] |= bits;
  }
}

}  // namespace

std::vector<Detection> find_candidates(const YoloOutput& output, float min_score,
                                       const std::vector<bool>& selected) {
  // Most anchors see nothing: one pass over whole rows finds the few that are worth a closer look.
  const auto anchors = static_cast<std::size_t>(output.anchors);
  std::vector<float> best(output.channel(4), output.channel(4) + anchors);
  for (int c = 1; c < output.classes; ++c) {
    const float* scores = output.channel(4 + c);
    for (std::size_t a = 0; a < anchors; ++a) best[a] = scores[a] > best[a] ? scores[a] : best[a];
  }

  std::vector<Detection> candidates;
  for (int a = 0; a < output.anchors; ++a) {
    const float score = best[static_cast<std::size_t>(a)];
    if (!(score >= min_score)) continue;
    int best_class = 0;
    while (output.channel(4 + best_class)[a] != score) ++best_class;
    if (!selected[static_cast<std::size_t>(best_class)]) continue;
    const float x = output.channel(0)[a], y = output.channel(1)[a];
    const float half_width = 0.5F * output.channel(2)[a], half_height = 0.5F * output.channel(3)[a];
    candidates.push_back(
        {x - half_width, y - half_height, x + half_width, y + half_height, score, best_class, a});
  }
  return candidates;
}

cv::Rect image_box(const Detection& detection, const Letterbox& letterbox) {
  if (!(detection.x1 > detection.x0 && detection.y1 > detection.y0)) return {};  // also one that is no number
  const cv::Point2d first = letterbox.to_image({detection.x0, detection.y0});
  const cv::Point2d last = letterbox.to_image({detection.x1, detection.y1});
  const auto nearest = [](double value, int size) {
    return static_cast<int>(std::lround(std::clamp(value, 0.0, static_cast<double>(size))));
  };
  const int left = nearest(first.x, letterbox.image.width), top = nearest(first.y, letterbox.image.height);
  const int right = nearest(last.x, letterbox.image.width);
  const int bottom = nearest(last.y, letterbox.image.height);
  if (right <= left || bottom <= top) return {};
  return {left, top, right - left, bottom - top};
}

BitMask decode_mask(const YoloOutput& output, const Detection& detection, const cv::Rect& box,
                    const Letterbox& letterbox) {
  BitMask mask(letterbox.image);
  if (box.empty()) return mask;
  const cv::Size size = output.prototype_size;
  const std::vector<Sample> columns =
      samples(box.x, box.width, letterbox.scale_x, letterbox.content.x,
              static_cast<double>(size.width) / letterbox.input.width, size.width);
  const std::vector<Sample> rows =
      samples(box.y, box.height, letterbox.scale_y, letterbox.content.y,
              static_cast<double>(size.height) / letterbox.input.height, size.height);
  const cv::Point first(columns.front().index, rows.front().index);
  const cv::Point last(std::min(columns.back().index + 2, size.width),
                       std::min(rows.back().index + 2, size.height));
  const cv::Rect part(first, last);
  const std::vector<float> logits = weighted_sum(output, detection.anchor, part);

  const auto width = static_cast<std::size_t>(part.width);
  std::vector<float> line(width + 1);  // one row of logits at the height of a row of pixels
  for (int y = 0; y < box.height; ++y) {
    const Sample row = rows[static_cast<std::size_t>(y)];
    const float* upper = logits.data() + static_cast<std::size_t>(row.index - part.y) * width;
    const float* lower = row.index + 1 < last.y ? upper + width : upper;
    for (std::size_t x = 0; x < width; ++x) line[x] = upper[x] + row.weight * (lower[x] - upper[x]);
    line[width] = line[width - 1];
    set_positive(line, part.x, columns, box.x, mask.row(box.y + y));
  }
  return mask;
}

}  // namespace ipl_slam
