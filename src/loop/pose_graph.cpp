#include "loop/pose_graph.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <stdexcept>

#include <ceres/ceres.h>

#include "geometry/se3_manifold.hpp"
#include "loop/relative_pose_cost.hpp"
#include "mapping/abort_callback.hpp"

namespace ipl_slam {
namespace {

// A step that gains less than this share of the cost is the last.
constexpr double kGain = 1e-6;

ceres::Problem::Options problem_options() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  return options;
}

ceres::Solver::Options solver_options(const PoseGraphOptions& options, AbortCallback& abort) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // CHOLMOD, the default, is partly GPL
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = kGain;
  solver.num_threads = 1;  // with more Ceres adds up in the order in which they finish
  solver.logging_type = ceres::SILENT;
  solver.callbacks.push_back(&abort);
  return solver;
}

void check_indices(const PoseGraph& graph) {
  for (const PoseGraph::Edge& edge : graph.edges) {
    if (edge.a >= graph.poses.size() || edge.b >= graph.poses.size())
      throw std::out_of_range("optimize_pose_graph: an edge's index lies outside the poses");
  }
}

}  // namespace

PoseGraphResult optimize_pose_graph(PoseGraph& graph, const PoseGraphOptions& options,
                                    const std::atomic<bool>* abort) {
  check_indices(graph);
  SE3Manifold manifold;
  std::vector<std::array<double, kPoseBlockSize>> blocks(graph.poses.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) to_pose_block(graph.poses[i].T_cw, blocks[i].data());
  std::deque<RelativePoseCost> costs;  // Ceres keeps pointers to them: a deque's elements do not move
  ceres::Problem problem(problem_options());
  for (const PoseGraph::Edge& edge : graph.edges) {
    if (edge.a == edge.b) continue;
    const double weight = std::sqrt(edge.weight), turn = weight * options.metres_per_radian;
    costs.emplace_back(edge.T_ab, Vector6d{weight, weight, weight, turn, turn, turn});
    problem.AddResidualBlock(&costs.back(), nullptr, blocks[edge.a].data(), blocks[edge.b].data());
  }
  const auto takes_part = [&](std::size_t i) { return problem.HasParameterBlock(blocks[i].data()); };
  const bool gauge_free =
      std::none_of(graph.poses.begin(), graph.poses.end(), [](const auto& pose) { return pose.fixed; });
  const auto fixed = [&](std::size_t i) { return graph.poses[i].fixed || (gauge_free && i == 0); };
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!takes_part(i)) continue;
    if (fixed(i)) {
      problem.SetParameterBlockConstant(blocks[i].data());
    } else {
      problem.SetManifold(blocks[i].data(), &manifold);
    }
  }

  AbortCallback callback(abort);
  PoseGraphResult result;
  result.aborted = callback.raised();
  if (result.aborted || costs.empty()) return result;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(options, callback), &problem, &summary);
  if (!summary.IsSolutionUsable()) {
    result.aborted = true;
    return result;
  }
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (takes_part(i) && !fixed(i)) graph.poses[i].T_cw = from_pose_block(blocks[i].data());
  result.initial_cost = summary.initial_cost;
  result.final_cost = summary.final_cost;
  result.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  result.aborted = callback.raised();
  return result;
}

}  // namespace ipl_slam
