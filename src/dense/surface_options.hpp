#pragma once

#include "common/options.hpp"

namespace ipl_slam {

/// What of a volume is taken for a surface.
struct SurfaceOptions {
  double min_weight = 1.0;    ///< of the views that measured a voxel; a view weighs 1 (far) to 16 (near)
  double carve = 0.5;         ///< a voxel is empty if views that look through it weigh more than this share
  double min_gradient = 0.4;  ///< of the signed distance, which is 1 by a single surface; at most its inverse
  int min_component = 40;     ///< connected points

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_weight", min_weight,
             {1.0, 65535.0, "", "voxels count from this weight on; a view weighs 1 (far) to 16 (near)"});
    v.number("carve", carve,
             {0.0, 1000.0, "",
              "a voxel is empty if the views that look through it weigh more than this share of those that "
              "see a surface about it"});
    v.number("min_gradient", min_gradient,
             {0.05, 1.0, "",
              "slope of the signed distance below which, or above the inverse of which, there is no surface: "
              "two of them were blended, or there is a gap between them"});
    v.number("min_component", min_component,
             {1, 1000000, "count",
              "specks of fewer connected points are dropped, of the mesh those of fewer than twice as many "
              "triangles"});
  }
};

}  // namespace ipl_slam
