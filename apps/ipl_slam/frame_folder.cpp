#include "frame_folder.hpp"

#include <regex>
#include <vector>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"

namespace ipl_slam::cli {

namespace fs = std::filesystem;

namespace {

// Stands in every folder that was made here: nothing is ever removed from one without it.
constexpr const char* kMark = ".made_by_ipl_slam";

bool made_here(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / kMark, ignored);
}

std::vector<fs::path> frame_files(const fs::path& folder) {
  static const std::regex named_by_time(R"(\d+\.\d{6}\.(jpg|png|txt))");
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (std::regex_match(entry.path().filename().string(), named_by_time)) files.push_back(entry.path());
  }
  return files;
}

void check(const fs::path& folder, const std::error_code& error) {
  if (error) {
    throw UserError(fmt::format("cannot write the folder '{}': {}; choose another with -o", folder.string(),
                                error.message()));
  }
}

}  // namespace

FrameFolder::FrameFolder(fs::path folder) : folder_(std::move(folder)), part_(folder_.string() + ".part") {
  for (const fs::path& folder : {folder_, part_}) {
    std::error_code ignored;
    if (fs::exists(folder, ignored) && !made_here(folder) && !fs::is_empty(folder, ignored)) {
      throw UserError(
          fmt::format("'{}' is in the way: it was not written by this program; choose another folder with -o",
                      folder.string()));
    }
  }
  clear(part_);
  std::error_code error;
  fs::create_directories(part_, error);
  check(part_, error);
  write_file_atomically(part_ / kMark, "");
}

FrameFolder::~FrameFolder() {
  clear(part_);
}

fs::path FrameFolder::file(double timestamp, const char* extension) const {
  return part_ / fmt::format("{:013.6f}{}", timestamp, extension);
}

void FrameFolder::add(double timestamp, const char* extension, const cv::Mat& image) const {
  write_image_atomically(file(timestamp, extension), image);
}

void FrameFolder::add(double timestamp, const char* extension, const std::string& text) const {
  write_file_atomically(file(timestamp, extension), text);
}

void FrameFolder::keep() {
  clear(folder_);
  std::error_code error;
  fs::create_directories(folder_, error);
  check(folder_, error);
  write_file_atomically(folder_ / kMark, "");
  for (const fs::path& file : frame_files(part_)) {
    fs::rename(file, folder_ / file.filename(), error);
    check(folder_, error);
  }
}

void FrameFolder::clear(const fs::path& folder) {
  if (!made_here(folder)) return;
  std::error_code ignored;
  for (const fs::path& file : frame_files(folder)) fs::remove(file, ignored);
  fs::remove(folder / kMark, ignored);
  if (!fs::remove(folder, ignored)) write_file_atomically(folder / kMark, "");  // something else is in it
}

}  // namespace ipl_slam::cli
