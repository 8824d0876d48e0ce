#pragma once

#include <deque>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/se3.hpp"
#include "segmentation/working_grid.hpp"

namespace ipl_slam {

struct FreeSpaceOptions {
  double memory = 2.5;      ///< how long earlier frames are remembered, s
  double interval = 0.06;   ///< between remembered frames, s
  double tolerance = 0.03;  ///< difference of inverse depth that noise and the pose's error explain, 1/m

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("memory", memory, {0.1, 60.0, "s", "how long earlier frames are remembered"});
    v.number("interval", interval, {0.0, 10.0, "s", "between remembered frames"});
    v.number("tolerance", tolerance,
             {1e-4, 1.0, "1/m", "difference of inverse depth that noise and the pose's error explain"});
  }
};

/// What views from other times say about each cell of a frame; numbers of views, CV_8UC1, at most 255.
struct FreeSpaceEvidence {
  cv::Mat free;   ///< they see past this place: what the frame shows here was not here then
  cv::Mat taken;  ///< they see a surface here

  explicit FreeSpaceEvidence(cv::Size size)
      : free(cv::Mat::zeros(size, CV_8UC1)), taken(cv::Mat::zeros(size, CV_8UC1)) {}
};

/// Depth seen from a known pose, which tells the space before the surfaces to be free. Neither a background
/// that becomes visible nor one that is covered contradicts it: what it says is only about what it sees.
class FreeSpaceView {
 public:
  /// inverse_depth: CV_32FC1 over the grid, 0 = none. tolerance: 1/m, see FreeSpaceOptions.
  FreeSpaceView(const cv::Mat& inverse_depth, const SE3& T_wc, double tolerance);

  /// Adds to the evidence what this view says about the cells of another frame seen from T_wc.
  void judge(const WorkingGrid& grid, const cv::Mat& inverse_depth, const SE3& T_wc,
             FreeSpaceEvidence& evidence) const;
  /// From now on these cells (CV_8UC1, not 0) tell of free space only. What moved when it was seen does not
  /// make its place one of something static: a mover that stops would be taken for its own background.
  void distrust(const cv::Mat& moving);

 private:
  SE3 T_cw_;
  // The farthest and the nearest inverse depth in the 3x3 cells around each, tolerance included, so that
  // neither depth edges nor slopes need exact poses. farthest > nearest where there is no depth.
  cv::Mat farthest_, nearest_;
};

/// Remembers what was seen lately. What stands where an earlier frame saw free space has moved there since,
/// wherever the camera is now; a mere difference of depth would mistake a background that becomes visible for
/// a mover.
class FreeSpaceMemory {
 public:
  /// Refers to the grid, which must outlive it.
  FreeSpaceMemory(const WorkingGrid& grid, const FreeSpaceOptions& options);

  /// What the remembered views say about a frame (CV_32FC1 inverse depths) seen from T_wc.
  [[nodiscard]] FreeSpaceEvidence evidence(const cv::Mat& inverse_depth, const SE3& T_wc) const;
  /// Remembers a view if the newest one remembered is old enough, and forgets what is too old.
  void add(const FreeSpaceView& view, double timestamp);
  void clear() { entries_.clear(); }

 private:
  struct Entry {
    double timestamp = 0.0;
    FreeSpaceView view;
  };

  const WorkingGrid& grid_;
  FreeSpaceOptions options_;
  std::deque<Entry> entries_;
};

}  // namespace ipl_slam
