#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// An image from a file, or what kept it from being read.
struct LoadedImage {
  cv::Mat
      image;  ///< as stored (IMREAD_UNCHANGED): 8 or 16 bits, 1, 3 (BGR) or 4 (BGRA) channels; may be empty
  std::string problem;  ///< "missing", "truncated" or "unreadable" where image is empty
  std::string detail;   ///< the file and what is wrong with it
};

/// Reads a PNG or JPEG file whole. Decoders fill the missing part of a truncated file with grey or with
/// nothing and call that a success; here such a file is a problem. Never throws for what stands in the file.
[[nodiscard]] LoadedImage load_image(const std::filesystem::path& file);

/// Whether the bytes of a PNG go up to and including its IEND chunk.
[[nodiscard]] bool png_is_complete(std::string_view bytes);

/// Whether the bytes of a JPEG go up to and including the EOI marker of the image itself (not of a thumbnail
/// in it).
[[nodiscard]] bool jpeg_is_complete(std::string_view bytes);

}  // namespace ipl_slam
