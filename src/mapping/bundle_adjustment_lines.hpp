#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>

#include "geometry/line3_manifold.hpp"
#include "geometry/se3_manifold.hpp"
#include "mapping/bundle_adjustment.hpp"

namespace ipl_slam {

using PoseBlock = std::array<double, kPoseBlockSize>;

/// The lines' part of bundle adjustment: their blocks, costs and classification. All references handed over
/// must outlive it; Ceres keeps pointers to them and into it.
class BundleLines {
 public:
  /// Makes a cost for every observation that can be used. `blocks`, two vectors per line, become the lines'
  /// blocks.
  BundleLines(const BundleProblem& problem, const Camera& camera, const DepthNoiseOptions& noise,
              std::span<Eigen::Vector3d> blocks);
  BundleLines(const BundleLines&) = delete;
  BundleLines& operator=(const BundleLines&) = delete;

  void add_to(ceres::Problem& ceres, std::vector<PoseBlock>& poses);
  /// Has Ceres eliminate the lines before the poses, together with the points.
  void order(const ceres::Problem& ceres, ceres::ParameterBlockOrdering& ordering) const;
  /// Sorts all observations at the current state and returns the robust cost of the usable ones.
  double classify(const std::vector<PoseBlock>& poses, std::vector<std::uint8_t>& outlier) const;
  void take_out(const std::vector<std::uint8_t>& outlier, ceres::Problem& ceres);
  /// Lines with an inlier; the others stay where they were.
  void write_back(const std::vector<std::uint8_t>& outlier, std::vector<Line3>& lines) const;

 private:
  [[nodiscard]] double* line(std::size_t i) const { return blocks_[2 * i].data(); }

  const std::vector<BundleProblem::LineObservation>& observations_;
  std::span<Eigen::Vector3d> blocks_;
  std::vector<std::unique_ptr<ceres::CostFunction>> costs_;   // per observation, null where it cannot be used
  std::vector<ceres::ResidualBlockId> residuals_;             // per observation, null where it takes no part
  std::vector<std::unique_ptr<ceres::LossFunction>> losses_;  // by number of rows, from 2
  Line3Manifold manifold_;
};

}  // namespace ipl_slam
