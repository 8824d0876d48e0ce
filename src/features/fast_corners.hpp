#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "common/cpu.hpp"

namespace ipl_slam {

/// A local maximum of the corner score, in pixels of its image.
struct Corner {
  std::int16_t x = 0, y = 0;
  std::uint8_t score = 0;
};

/// Pixels around a corner that its test reads: the score is defined this far from the image border and
/// further in.
inline constexpr int kFastRadius = 3;

/// FAST-9/16 corner score of every pixel in `area`: the largest t for which nine contiguous pixels of the
/// circle of radius 3 are all brighter than the centre by at least t, or all darker by at least t. Scores <=
/// threshold become 0. Source: Rosten and Drummond, "Machine learning for high-speed corner detection", ECCV
/// 2006; the score is the one that cv::FAST uses, so a pixel is a corner at threshold t exactly if its score
/// here exceeds t.
///
/// `image` and `score` are CV_8UC1 of one size; `area` keeps kFastRadius from the border. Score pixels
/// outside `area` are left alone. Throws std::invalid_argument otherwise.
void fast_score(const cv::Mat& image, const cv::Rect& area, int threshold, cv::Mat& score,
                Simd simd = best_simd());

/// Appends the local 3x3 maxima of `score` inside `area` (at least one pixel inside the border), row by row.
/// Of equal neighbours the first in reading order counts as the maximum.
void find_score_maxima(const cv::Mat& score, const cv::Rect& area, std::vector<Corner>& corners,
                       Simd simd = best_simd());

}  // namespace ipl_slam
