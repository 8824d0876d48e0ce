#pragma once

#include <deque>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/se3.hpp"
#include "segmentation/edge_aware_filter.hpp"
#include "segmentation/free_space.hpp"
#include "segmentation/working_grid.hpp"

namespace ipl_slam {

struct MotionBeliefOptions {
  int min_free = 2;          ///< earlier frames that must have seen past a cell
  double free_share = 0.25;  ///< and their share of those that say anything
  double taken_weight =
      1.0;  ///< of a cell that stands where earlier frames saw a surface; of one that entered free space: 1
  int full_taken = 20;         ///< earlier frames that must have seen a surface there for all of that weight
  double hindsight = 0.15;     ///< how much later it is judged what has left its place, s
  double memory_weight = 0.5;  ///< of what was believed in the last frame
  double bias = 0.05;          ///< weight of believing, without any evidence, that a cell is static
  double unseen_bias =
      0.2;  ///< the same where no earlier frame says anything: nothing there holds against what leaks in
  double reach = 0.3;        ///< how far evidence spreads along a surface, m
  double depth_step = 0.01;  ///< relative step of depth between cells that is still one surface
  double grey_step = 12.0;   ///< step of grey value that weakens the spreading by the factor e
  int passes = 2;            ///< of the filter that spreads evidence

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_free", min_free, {1, 100, "count", "earlier frames that must have seen past a cell"});
    v.number("free_share", free_share,
             {0.0, 1.0, "", "and their share of the earlier frames that say anything about it"});
    v.number("taken_weight", taken_weight,
             {0.0, 10.0, "", "weight of a cell where earlier frames saw a surface; of one in free space: 1"});
    v.number("full_taken", full_taken,
             {1, 250, "count", "earlier frames that must have seen a surface there for all of that weight"});
    v.number("hindsight", hindsight, {0.0, 10.0, "s", "how much later it is judged what has left its place"});
    v.number("memory_weight", memory_weight,
             {0.0, 10.0, "", "weight of what was believed in the last frame"});
    v.number("bias", bias, {0.0, 10.0, "", "weight of believing without evidence that a cell is static"});
    v.number("unseen_bias", unseen_bias,
             {0.0, 10.0, "", "the same for a cell about which no earlier frame says anything"});
    v.number("reach", reach, {0.01, 100.0, "m", "how far evidence spreads along a surface"});
    v.number("depth_step", depth_step,
             {1e-4, 1.0, "", "relative step of depth between cells that is still one surface"});
    v.number("grey_step", grey_step,
             {1.0, 1e6, "grey value", "step between cells that weakens the spreading by the factor e"});
    v.number("passes", passes, {1, 20, "count", "passes of the filter that spreads evidence"});
  }
};

/// How easily evidence passes between neighbouring cells: well within a smooth surface, hardly over an edge
/// of depth, and where depth is missing as the grey values say. The reach is a length in the world, so that a
/// body that fills the image is filled like one far away.
[[nodiscard]] Conductance surface_conductance(const GridFrame& frame, const WorkingGrid& grid,
                                              const MotionBeliefOptions& options);

/// For every cell how sure it is that it moves or has moved lately, -1 (static) to 1, CV_32FC1. What is known
/// of single cells is averaged over the surface around each:
/// - it stands where earlier frames saw free space (entered), or a surface;
/// - it belongs to a surface of which parts left their place: where an earlier frame saw them, this one sees
///   free space. That judges the earlier frame in hindsight, and is carried over;
/// - what was believed in the last frame.
class MotionBelief {
 public:
  /// Refers to the grid, which must outlive it.
  MotionBelief(const WorkingGrid& grid, const MotionBeliefOptions& options);

  /// The belief about a frame seen from T_wc. evidence: of earlier views about it; view: its own view.
  const cv::Mat& update(const GridFrame& frame, const SE3& T_wc, double timestamp,
                        const FreeSpaceEvidence& evidence, const Conductance& conductance,
                        const FreeSpaceView& view);
  void clear() { past_.clear(); }

 private:
  struct Past {
    double timestamp = 0.0;
    SE3 T_wc;
    cv::Mat inverse_depth;
    Conductance conductance;
    cv::Mat belief;
  };

  [[nodiscard]] cv::Mat entered(const FreeSpaceEvidence& evidence, int min_free) const;
  [[nodiscard]] cv::Mat averaged(const FreeSpaceEvidence& evidence, int min_free, const cv::Mat& prior,
                                 const Conductance& conductance) const;
  [[nodiscard]] cv::Mat carried(const Past& from, const cv::Mat& belief, const cv::Mat& inverse_depth,
                                const SE3& T_wc) const;

  const WorkingGrid& grid_;
  MotionBeliefOptions options_;
  std::deque<Past> past_;  // the last frames, from the one that hindsight judges on
};

}  // namespace ipl_slam
