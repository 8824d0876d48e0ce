#include "dataset/image_file.hpp"

#include <cstdint>
#include <exception>
#include <system_error>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "common/text_file.hpp"

#if defined(__SANITIZE_THREAD__)
// Debian's OpenCV registers GDAL's formats with the first image it decodes. GDAL takes two of its own locks
// in both orders while one thread does so, which ThreadSanitizer reports as a possible deadlock; nothing of
// ours is concerned.
extern "C" const char* __tsan_default_suppressions() {
  return "deadlock:libgdal.so\n";
}
#endif

namespace ipl_slam {
namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1A\n";
constexpr std::string_view kJpegSignature = "\xFF\xD8\xFF";

std::uint8_t byte_at(std::string_view bytes, std::size_t i) {
  return static_cast<std::uint8_t>(bytes[i]);
}

std::uint32_t big_endian_32(std::string_view bytes, std::size_t i) {
  return static_cast<std::uint32_t>(byte_at(bytes, i)) << 24 |
         static_cast<std::uint32_t>(byte_at(bytes, i + 1)) << 16 |
         static_cast<std::uint32_t>(byte_at(bytes, i + 2)) << 8 | byte_at(bytes, i + 3);
}

LoadedImage problem(const char* what, const std::filesystem::path& file, const std::string& detail) {
  return {{}, what, fmt::format("{}: {}", file.string(), detail)};
}

cv::Mat decode(const std::string& bytes) {
  // A view on the bytes; imdecode reads only.
  const cv::Mat view(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
  return cv::imdecode(view, cv::IMREAD_UNCHANGED);
}

}  // namespace

bool png_is_complete(std::string_view bytes) {
  if (!bytes.starts_with(kPngSignature)) return false;
  // Chunks: length, type, data, checksum.
  std::size_t at = kPngSignature.size();
  while (bytes.size() >= at + 12) {
    const std::uint64_t length = big_endian_32(bytes, at);
    if (at + 12 + length > bytes.size()) return false;
    if (bytes.substr(at + 4, 4) == "IEND") return true;
    at += 12 + length;
  }
  return false;
}

bool jpeg_is_complete(std::string_view bytes) {
  if (!bytes.starts_with(kJpegSignature)) return false;
  constexpr std::uint8_t stuffing = 0x00, restart_0 = 0xD0, restart_7 = 0xD7, end_of_image = 0xD9,
                         fill = 0xFF, start_of_scan = 0xDA, temporary = 0x01;
  std::size_t at = 2;
  bool in_scan = false;
  while (at + 1 < bytes.size()) {
    if (byte_at(bytes, at) != 0xFF) {
      // Coded pixels of a scan run on until the next marker; anywhere else a marker must stand here.
      if (!in_scan) return false;
      at = bytes.find('\xFF', at);
      if (at == std::string_view::npos) return false;
      continue;
    }
    const std::uint8_t marker = byte_at(bytes, at + 1);
    if (marker == end_of_image) return true;
    if (marker == fill) {
      ++at;
    } else if (marker == stuffing || marker == temporary || (marker >= restart_0 && marker <= restart_7)) {
      at += 2;
    } else {
      if (at + 4 > bytes.size()) return false;
      in_scan = marker == start_of_scan;
      at += 2 + (std::size_t{byte_at(bytes, at + 2)} << 8 | byte_at(bytes, at + 3));
    }
  }
  return false;
}

LoadedImage load_image(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return problem("missing", file, "no such file");
  try {
    const std::string bytes = read_file(file);
    const bool png = bytes.starts_with(kPngSignature), jpeg = bytes.starts_with(kJpegSignature);
    if (bytes.empty()) return problem("truncated", file, "the file is empty");
    if (!png && !jpeg) return problem("unreadable", file, "neither PNG nor JPEG");
    if (png ? !png_is_complete(bytes) : !jpeg_is_complete(bytes)) {
      return problem("truncated", file, fmt::format("the file ends too early, after {} bytes", bytes.size()));
    }
    cv::Mat image = decode(bytes);
    if (image.empty()) return problem("unreadable", file, "its data is damaged");
    return {std::move(image), {}, {}};
  } catch (const std::exception&
               failure) {  // unreadable file, or a picture too large for OpenCV or for the memory
    return problem("unreadable", file, failure.what());
  }
}

}  // namespace ipl_slam
