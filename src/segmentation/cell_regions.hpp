#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "segmentation/edge_aware_filter.hpp"
#include "segmentation/instance.hpp"
#include "segmentation/working_grid.hpp"

namespace ipl_slam {

/// A connected piece of the working grid.
struct CellRegion {
  int label = 0;  ///< its value in the label image, from 1 on
  int area = 0;   ///< cells
  cv::Rect box;   ///< cells
};

/// Splits the cells that are on (CV_8UC1, not 0) into pieces. Neighbours belong together where the
/// conductance between them is at least min_conductance, so that two movers one behind the other are two.
/// labels: CV_32SC1, 0 where off.
[[nodiscard]] std::vector<CellRegion> connected_regions(const cv::Mat& on, const Conductance& conductance,
                                                        double min_conductance, cv::Mat& labels);

/// The mask of a region at full resolution. Cells on its border are cut by the depth image (CV_16UC1, raw): a
/// pixel goes to the neighbouring cell nearest to it in inverse depth.
[[nodiscard]] BitMask region_mask(const CellRegion& region, const cv::Mat& labels, const GridFrame& frame,
                                  const cv::Mat& depth, const WorkingGrid& grid);

}  // namespace ipl_slam
