#pragma once

#include <filesystem>
#include <string_view>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// Writes a whole file so that a reader sees the old content or the new one, never a part: the bytes go to a
/// temporary file in the same folder, are flushed to the disk, and the temporary is renamed over `file`. A
/// symbolic link is followed; a device or pipe that exists (/dev/stdout) cannot be renamed over and is
/// written to directly. Throws UserError naming the file and the mend (no such folder, no permission, disk
/// full, ...); the temporary is removed and what stood at `file` before stays untouched.
void write_file_atomically(const std::filesystem::path& file, std::string_view content);

/// Whether write_file_atomically would find a place to write to: throws UserError as it does, and leaves what
/// stands at `file` alone. To be asked before hours of work whose result goes there.
void check_writable(const std::filesystem::path& file);

/// Writes an image in the same way, encoded by the file's extension (.png, .jpg, ...). Throws UserError,
/// besides the above, when the extension names no image format or the format cannot hold the image's type.
void write_image_atomically(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace ipl_slam
