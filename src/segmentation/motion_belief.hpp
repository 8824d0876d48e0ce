#pragma once

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/se3.hpp"
#include "segmentation/edge_aware_filter.hpp"
#include "segmentation/free_space.hpp"
#include "segmentation/working_grid.hpp"

namespace ipl_slam {

struct MotionBeliefOptions {
  int min_entered = 2;          ///< earlier frames that must have seen past a cell
  double entered_share = 0.25;  ///< and their share of those that say anything
  double agreed_weight = 0.3;   ///< of a cell that stands where earlier frames saw a surface; one that entered: 1
  double memory_weight = 0.5;   ///< of what was believed in the last frame
  double bias = 0.1;            ///< weight of believing, without any evidence, that a cell is static
  double reach = 12.0;          ///< how far evidence spreads along a surface, cells
  double depth_step = 0.01;     ///< relative step of depth between cells that is still one surface
  double grey_step = 30.0;      ///< step of grey value that weakens the spreading by the factor e
  int passes = 2;               ///< of the filter that spreads evidence

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_entered", min_entered, {1, 100, "count", "earlier frames that must have seen past a cell"});
    v.number("entered_share", entered_share,
             {0.0, 1.0, "", "and their share of the earlier frames that say anything about it"});
    v.number("agreed_weight", agreed_weight,
             {0.0, 10.0, "", "weight of a cell where earlier frames saw a surface; of one that entered: 1"});
    v.number("memory_weight", memory_weight, {0.0, 10.0, "", "weight of what was believed in the last frame"});
    v.number("bias", bias, {0.0, 10.0, "", "weight of believing without evidence that a cell is static"});
    v.number("reach", reach, {1.0, 1000.0, "cells", "how far evidence spreads along a surface"});
    v.number("depth_step", depth_step,
             {1e-4, 1.0, "", "relative step of depth between cells that is still one surface"});
    v.number("grey_step", grey_step,
             {1.0, 1e6, "grey value", "step between cells that weakens the spreading by the factor e"});
    v.number("passes", passes, {1, 20, "count", "passes of the filter that spreads evidence"});
  }
};

/// How easily evidence passes between neighbouring cells: well within a smooth surface, hardly over an edge of
/// depth, and where depth is missing as the grey values say.
[[nodiscard]] Conductance surface_conductance(const GridFrame& frame, const MotionBeliefOptions& options);

/// For every cell how sure it is that it moves or has moved lately, -1 (static) to 1, CV_32FC1. The evidence
/// of single cells and what was believed before are averaged over the surface around each cell.
class MotionBelief {
 public:
  /// Refers to the grid, which must outlive it.
  MotionBelief(const WorkingGrid& grid, const MotionBeliefOptions& options);

  /// The belief about a frame seen from T_wc; kept as the memory for the next one.
  const cv::Mat& update(const GridFrame& frame, const SE3& T_wc, const FreeSpaceEvidence& evidence,
                        const Conductance& conductance);
  void clear() { belief_.release(); }

 private:
  [[nodiscard]] cv::Mat carried(const GridFrame& frame, const SE3& T_wc) const;

  const WorkingGrid& grid_;
  MotionBeliefOptions options_;
  // Of the last frame.
  cv::Mat belief_, inverse_depth_;
  SE3 T_wc_;
};

}  // namespace ipl_slam
