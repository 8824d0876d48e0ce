#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "common/options.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// Poses and what is known of them relative to each other, by index.
struct PoseGraph {
  struct Pose {
    SE3 T_cw;
    bool fixed = false;
  };
  struct Edge {
    std::uint32_t a = 0, b = 0;  ///< indices into poses
    SE3 T_ab;                    ///< camera b to camera a
    double weight = 1.0;         ///< of its squared residual, above 0
  };
  std::vector<Pose> poses;
  std::vector<Edge> edges;
};

struct PoseGraphOptions {
  int max_iterations = 30;
  double metres_per_radian = 3.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_iterations", max_iterations, {1, 1000, "count", "steps at most"});
    v.number(
        "metres_per_radian", metres_per_radian,
        {0.01, 1000.0, "m/rad",
         "an error of one radian counts as much as this many metres: about how far off what is seen is"});
  }
};

struct PoseGraphResult {
  double initial_cost = 0.0, final_cost = 0.0;  ///< half the sum of squared residuals, m^2
  int iterations = 0;
  bool aborted = false;  ///< also where no solution was found; then all poses keep their value
};

/// Moves the poses that are not fixed so that the sum of weight x |e|^2 over the edges becomes least, with
///
///   e = log(T_aw T_wb T_ab^-1) = (rho, phi), phi times metres_per_radian
///
/// (Ceres, sparse Cholesky, analytic Jacobians). Where no pose is fixed the first is. Fixed poses, and those
/// without an edge, keep their value to the last byte. `abort`, when not null, is polled between steps: then
/// the poses hold the best state reached so far. Runs on the calling thread alone; same input, same bytes.
/// Throws std::out_of_range for an edge whose index lies outside the poses.
PoseGraphResult optimize_pose_graph(PoseGraph& graph, const PoseGraphOptions& options,
                                    const std::atomic<bool>* abort = nullptr);

}  // namespace ipl_slam
