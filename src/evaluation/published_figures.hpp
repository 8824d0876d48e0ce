#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ipl_slam {

/// Absolute trajectory error of a system on a sequence, metres, as it was published.
struct PublishedAte {
  std::string system;
  double rmse = 0.0;
  std::optional<double> mean, median, std;
};

/// Mean times of a system per frame, milliseconds.
struct PublishedTimes {
  std::string system;
  double features = 0.0;  ///< points, and lines where the system has them
  double segmentation = 0.0;
};

/// What was published about a sequence.
struct PublishedSequence {
  std::string name;  ///< "fr3/walking_xyz"
  std::vector<PublishedAte> ate;
  std::optional<std::array<double, 4>> ablation;  ///< ATE RMSE of IPL-SLAM, one per ablation_titles()
  std::vector<PublishedTimes> times;
};

/// Figures of Tables 1 to 4 of the IPL-SLAM paper (Liu, Yao, Liu, Yuan, Biomimetics 2025, 10(9), 558). Left
/// out are the other systems' figures for fr3/sitting_rpy in Table 2: in the text we have, the columns they
/// stand in are lost. None of them is the best one there.
[[nodiscard]] const std::vector<PublishedSequence>& published_sequences();

/// The systems of published_sequences(), in the paper's order.
[[nodiscard]] const std::vector<std::string>& published_systems();

/// Column titles of Table 3.
[[nodiscard]] const std::array<std::string, 4>& ablation_titles();

/// The published sequence that a folder's name stands for, in the benchmark's spelling or the usual short
/// ones ("rgbd_dataset_freiburg3_walking_xyz", "fr3_walking_xyz", "fr3_w_half"), or null. Names with anything
/// more ("fr3_walking_xyz_validation", "fr3_walking_xyz_100") mean another sequence or a part of one.
[[nodiscard]] const PublishedSequence* find_published(std::string_view folder_name);

/// The smallest published figure of a kind, by whatever system; nothing where none was published.
[[nodiscard]] std::optional<double> best_published(const PublishedSequence& sequence,
                                                   std::optional<double> (*figure)(const PublishedAte&));

}  // namespace ipl_slam
