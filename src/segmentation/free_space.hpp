#pragma once

#include <deque>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/se3.hpp"
#include "segmentation/working_grid.hpp"

namespace ipl_slam {

struct FreeSpaceOptions {
  double memory = 2.5;      ///< how long earlier frames are remembered, s
  double interval = 0.1;    ///< between remembered frames, s
  double tolerance = 0.03;  ///< difference of inverse depth that noise and the pose's error explain, 1/m

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("memory", memory, {0.1, 60.0, "s", "how long earlier frames are remembered"});
    v.number("interval", interval, {0.0, 10.0, "s", "between remembered frames"});
    v.number("tolerance", tolerance,
             {1e-4, 1.0, "1/m", "difference of inverse depth that noise and the pose's error explain"});
  }
};

/// What earlier frames say about each cell of a frame; numbers of earlier frames, CV_8UC1.
struct FreeSpaceEvidence {
  cv::Mat entered;  ///< they saw past this place: what is here now came later
  cv::Mat agreed;   ///< they saw a surface here
};

/// Remembers depth seen from known poses. A camera that sees a surface sees that the space before it is free;
/// what stands in that space later has moved there, wherever the camera is then. Unlike a mere difference of
/// depth this does not mistake a background that becomes visible for a mover: there the earlier frames saw
/// something nearer, and say nothing.
class FreeSpaceMemory {
 public:
  /// Refers to the grid, which must outlive it.
  FreeSpaceMemory(const WorkingGrid& grid, const FreeSpaceOptions& options);

  /// What the remembered frames say about a frame (CV_32FC1 inverse depths) seen from T_wc.
  [[nodiscard]] FreeSpaceEvidence evidence(const cv::Mat& inverse_depth, const SE3& T_wc) const;
  /// Remembers the frame if the newest one remembered is old enough, and forgets what is too old.
  void add(const cv::Mat& inverse_depth, const SE3& T_wc, double timestamp);
  void clear() { views_.clear(); }

 private:
  struct View {
    double timestamp = 0.0;
    SE3 T_cw;
    // The farthest and the nearest inverse depth in the 3x3 cells around each, tolerance included, so that
    // neither depth edges nor slopes need exact poses. farthest > nearest where there is no depth.
    cv::Mat farthest, nearest;
  };

  const WorkingGrid& grid_;
  FreeSpaceOptions options_;
  std::deque<View> views_;
};

}  // namespace ipl_slam
