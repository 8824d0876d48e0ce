#pragma once

#include <filesystem>
#include <string>

#include <opencv2/core.hpp>

namespace ipl_slam::cli {

/// A folder with files that are named by their frames' timestamps ("1305031102.175304.jpg", zeros in front so
/// that names sort by time). They are written into a folder beside it, of the same name with ".part" added,
/// and take the place of those of an earlier run in keep(); without keep() nothing changes. Files with other
/// names, and folders that were not made here, are never touched.
class FrameFolder {
 public:
  /// Throws UserError when it cannot be written or something else stands there.
  explicit FrameFolder(std::filesystem::path folder);
  ~FrameFolder();
  FrameFolder(const FrameFolder&) = delete;
  FrameFolder& operator=(const FrameFolder&) = delete;

  void add(double timestamp, const char* extension, const cv::Mat& image) const;
  void add(double timestamp, const char* extension, const std::string& text) const;
  void keep();

  /// Takes away the files of an earlier run, and the folder if nothing else is in it.
  static void clear(const std::filesystem::path& folder);

 private:
  [[nodiscard]] std::filesystem::path file(double timestamp, const char* extension) const;

  std::filesystem::path folder_, part_;
};

}  // namespace ipl_slam::cli
