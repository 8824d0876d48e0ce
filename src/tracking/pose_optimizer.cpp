#include "tracking/pose_optimizer.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "geometry/reprojection.hpp"
#include "geometry/robust.hpp"
#include "tracking/pose_optimizer_kernel.hpp"

namespace ipl_slam {
namespace {

using namespace pose_kernel;

constexpr int kMinInliers = 3;

Matrix6d hessian_matrix(const Normal& normal) {
  Matrix6d h;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) h(r, c) = h(c, r) = normal.hessian[upper(r, c)];
  return h;
}

// Levenberg-Marquardt with the damping on the diagonal of J^T W J (Marquardt 1963). Stops early where a step
// gains less than `gain` of the cost. Leaves the pose at the best state found.
void minimize(const Camera& camera, bool robust, int iterations, double gain, MatchTable& table, SE3& T_cw) {
  constexpr double kFirstDamping = 1e-4, kMostDamping = 1e8, kSmallStep = 1e-10;
  Normal now, trial;
  evaluate(camera, T_cw, robust, table, now);
  double damping = kFirstDamping;
  for (int i = 0; i < iterations && damping < kMostDamping; ++i) {
    Matrix6d h = hessian_matrix(now);
    // The floor keeps a direction that no match sees solvable; the step along it is then zero.
    for (int d = 0; d < 6; ++d) h(d, d) += damping * std::max(h(d, d), 1e-6);
    const Vector6d step = -h.ldlt().solve(Eigen::Map<const Vector6d>(now.gradient));
    if (!step.allFinite()) return;
    if (step.squaredNorm() < kSmallStep * kSmallStep) return;
    const SE3 T_trial = SE3::exp(step) * T_cw;
    evaluate(camera, T_trial, robust, table, trial);
    if (!(trial.cost < now.cost)) {
      damping *= 10.0;
      continue;
    }
    const bool settled = now.cost - trial.cost < gain * now.cost;
    T_cw = T_trial;
    now = trial;
    damping = std::max(damping * 0.1, 1e-12);
    if (settled) return;
  }
}

// No length in metres, pixel or variance of a real camera comes near this; beyond it squares lose their
// meaning.
bool sensible(double value) {
  return std::abs(value) < 1e9;
}

bool usable(const PointMatch& m) {
  return sensible(m.point_w.x()) && sensible(m.point_w.y()) && sensible(m.point_w.z()) &&
         sensible(m.uv.x()) && sensible(m.uv.y()) && std::isfinite(m.depth) && m.sigma2 > 1e-9 &&
         sensible(m.sigma2) && m.weight > 0.0 && sensible(m.weight);
}

// Fills the row of a usable match; its kWeight stays 0 until it is taken for an inlier.
void fill(const PointMatch& m, const DepthNoiseOptions& noise, std::size_t i, MatchTable& table) {
  const bool has_depth = m.depth >= kMinProjectionDepth && m.depth <= noise.max_depth;
  const double sigma = noise.inverse_depth_sigma;
  table.set(i, kX, m.point_w.x());
  table.set(i, kY, m.point_w.y());
  table.set(i, kZ, m.point_w.z());
  table.set(i, kU, m.uv.x());
  table.set(i, kV, m.uv.y());
  table.set(i, kInverseDepth, has_depth ? 1.0 / m.depth : 0.0);
  table.set(i, kPixelInfo, 1.0 / m.sigma2);
  table.set(i, kDepthInfo, has_depth ? 1.0 / (sigma * sigma) : 0.0);
  table.set(i, kHuber, std::sqrt(has_depth ? kChi2For3Dof : kChi2For2Dof));
}

// Takes every usable match within the chi-square threshold for an inlier and lets only those weigh. True
// where that changed anything.
bool sort_matches(std::span<const PointMatch> matches, MatchTable& table, PoseEstimate& estimate) {
  bool changed = false;
  estimate.inliers = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const double huber = table.get(i, kHuber);  // 0 for a match that cannot be used
    const std::uint8_t inlier = huber > 0.0 && table.get(i, kChi2) <= huber * huber ? 1 : 0;
    changed |= inlier != estimate.inlier[i];
    estimate.inlier[i] = inlier;
    estimate.inliers += inlier;
    table.set(i, kWeight, inlier ? matches[i].weight : 0.0);
  }
  return changed;
}

}  // namespace

PoseOptimizer::PoseOptimizer(const Camera& camera, const DepthNoiseOptions& noise,
                             const PoseOptimizerOptions& options)
    : camera_(camera), noise_(noise), options_(options) {}

PoseEstimate PoseOptimizer::optimize(const SE3& T_cw, std::span<const PointMatch> matches) const {
  const PoseEstimate nothing{.T_cw = T_cw, .inlier = std::vector<std::uint8_t>(matches.size(), 0)};
  PoseEstimate estimate = nothing;
  MatchTable table(matches.size());
  int usable_matches = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!usable(matches[i])) continue;
    fill(matches[i], noise_, i, table);
    if ((T_cw * matches[i].point_w).z() < kMinProjectionDepth) continue;
    table.set(i, kWeight, matches[i].weight);
    ++usable_matches;
  }
  if (usable_matches < kMinInliers) return nothing;

  Normal normal;
  for (int round = 0; round < options_.rounds; ++round) {
    // While outliers still pull, the exact minimum is not worth its steps.
    const bool robust = round < options_.robust_rounds;
    minimize(camera_, robust, options_.iterations, robust ? 1e-3 : 1e-6, table, estimate.T_cw);
    evaluate(camera_, estimate.T_cw, false, table, normal);
    const bool changed = sort_matches(matches, table, estimate);
    if (estimate.inliers < kMinInliers) return nothing;
    if (!changed && !robust) break;
  }
  evaluate(camera_, estimate.T_cw, false, table, normal);
  estimate.information = hessian_matrix(normal);
  return estimate;
}

}  // namespace ipl_slam
