#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dataset/synthetic/write_sequence.hpp"
#include "dataset/temporary_folder.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam::testing {

/// A rendered sequence of ten frames on disk, for a test to spoil.
class MadeSequence {
 public:
  static constexpr int kFrames = 10;

  /// More frames go on where the ten end; what spoils a sequence below knows of ten.
  explicit MadeSequence(int frames = kFrames) {
    SequenceWriteOptions options;
    options.threads = 2;
    write_sequence(SyntheticSource(small_room(frames)), folder_ / "room", options);
  }

  [[nodiscard]] std::filesystem::path path() const { return folder_ / "room"; }
  [[nodiscard]] std::filesystem::path output() const { return folder_ / "run"; }
  [[nodiscard]] std::filesystem::path beside(const std::string& name) const { return folder_ / name; }

  /// The image of a frame, "rgb" or "depth".
  [[nodiscard]] std::filesystem::path image(const char* kind, int frame) const {
    std::ifstream list(path() / fmt::format("{}.txt", kind));
    std::string line, time, name;
    for (int i = -1; i < frame && std::getline(list, line);) i += line.starts_with('#') ? 0 : 1;
    return path() / line.substr(line.find(' ') + 1);
  }
  void write(const std::string& name, const std::string& content) const {
    std::ofstream(path() / name, std::ios::binary) << content;
  }
  void append(const std::string& name, const std::string& content) const {
    std::ofstream(path() / name, std::ios::binary | std::ios::app) << content;
  }
  /// Gives the frames times a second apart: played at recorded speed there is time to interrupt.
  void slow_down() const {
    std::string colors, depths;
    for (int i = 0; i < kFrames; ++i) {
      colors += fmt::format("{} {}\n", i, std::filesystem::relative(image("rgb", i), path()).string());
      depths += fmt::format("{} {}\n", i, std::filesystem::relative(image("depth", i), path()).string());
    }
    write("rgb.txt", colors);
    write("depth.txt", depths);
  }
  /// Makes another place of it: its mirror image.
  void mirror() const {
    for (int i = 0; i < kFrames; ++i) {
      for (const char* kind : {"rgb", "depth"}) {
        cv::Mat mirrored;
        cv::flip(cv::imread(image(kind, i).string(), cv::IMREAD_UNCHANGED), mirrored, 1);
        replace(kind, i, mirrored);
      }
    }
  }
  void replace(const char* kind, int frame, const cv::Mat& by) const {
    cv::imwrite(image(kind, frame).string(), by);
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace ipl_slam::testing
