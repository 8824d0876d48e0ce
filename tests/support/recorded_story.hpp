#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dataset/synthetic/synthetic_source.hpp"
#include "dataset/temporary_folder.hpp"
#include "dataset/trajectory.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam::testing {

/// A story of the built-in renderer, rendered once, with its true masks. Masks show the actors only, i.e.
/// people and whatever moves at some time; furniture is left out.
class RecordedStory {
 public:
  explicit RecordedStory(const SyntheticOptions& options) {
    const SyntheticSource source(options, 2);
    camera_ = source.camera();
    for (const SyntheticObject& object : source.objects()) {
      if (object.moving || object.class_name == "person") actors_.push_back(object);
    }
    for (std::size_t i = 0; i < source.size(); ++i) {
      SyntheticFrame frame = source.render(i);
      truth_.push_back({source.timestamp(i), frame.T_wc});
      frames_.push_back(std::move(frame.rgbd));
      labels_.emplace_back(frame.mask.size(), CV_8UC1, cv::Scalar(0));
      for (const SyntheticObject& actor : actors_) labels_.back().setTo(actor.id, frame.mask == actor.id);
    }
  }

  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] const std::vector<RgbdFrame>& frames() const { return frames_; }
  [[nodiscard]] std::size_t size() const { return frames_.size(); }
  [[nodiscard]] const Trajectory& truth() const { return truth_; }
  [[nodiscard]] const std::vector<SyntheticObject>& actors() const { return actors_; }
  /// CV_8UC1 per frame: the id of an actor, 0 = nobody.
  [[nodiscard]] const std::vector<cv::Mat>& labels() const { return labels_; }

  /// Share of the pixels that actors cover.
  [[nodiscard]] double covered(std::size_t frame) const {
    return static_cast<double>(cv::countNonZero(labels_[frame])) /
           static_cast<double>(labels_[frame].total());
  }
  /// The same, mean over all frames.
  [[nodiscard]] double covered() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < size(); ++i) sum += covered(i);
    return sum / static_cast<double>(size());
  }

  /// What a segmenter fails at: changes the label image of a frame before it is written.
  using Spoil = std::function<void(std::size_t frame, cv::Mat& labels)>;

  /// Fills the folder with what the segmenter `masks` reads.
  void write_masks(const TemporaryFolder& folder, const Spoil& spoil = {}) const {
    std::string list, classes;
    for (std::size_t i = 0; i < size(); ++i) {
      cv::Mat labels = labels_[i].clone();
      if (spoil) spoil(i, labels);
      const std::string name = fmt::format("{}.png", i);
      cv::imwrite((folder / name).string(), labels);
      list += fmt::format("{:.6f} {}\n", truth_[i].timestamp, name);
    }
    for (const SyntheticObject& actor : actors_)
      classes += fmt::format("{} {}\n", actor.id, actor.class_name);
    folder.write("masks.txt", list);
    folder.write("classes.txt", classes);
  }

 private:
  Camera camera_;
  std::vector<RgbdFrame> frames_;
  Trajectory truth_;
  std::vector<SyntheticObject> actors_;
  std::vector<cv::Mat> labels_;
};

}  // namespace ipl_slam::testing
