#include "tracking/pose_optimizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "geometry/reprojection.hpp"
#include "geometry/robust.hpp"
#include "tracking/pose_optimizer_kernel.hpp"
#include "tracking/pose_optimizer_line_kernel.hpp"

namespace ipl_slam {
namespace {

using namespace pose_kernel;

constexpr int kMinInliers = 3;  // points and lines together

// All matches of one frame.
struct Tables {
  MatchTable points;
  LineTable lines;

  void evaluate(const Camera& camera, const SE3& T_cw, bool robust, Normal& out) {
    pose_kernel::evaluate(camera, T_cw, robust, points, out);
    if (!lines.blocks().empty()) evaluate_lines(camera, T_cw, robust, lines, out);
  }
};

Matrix6d hessian_matrix(const Normal& normal) {
  Matrix6d h;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) h(r, c) = h(c, r) = normal.hessian[upper(r, c)];
  return h;
}

// What the damping of Levenberg and Marquardt multiplies: the diagonal of J^T W J (Marquardt 1963). Parallel
// lines leave a direction unseen that lies askew to the axes; there, only a damping that is alike in all
// directions keeps the step out of it, so with lines each half of the pose has the mean of its diagonal. The
// floor keeps a direction that no match sees solvable; the step along it is then zero.
Vector6d damping_scale(const Matrix6d& h, bool with_lines) {
  Vector6d scale = h.diagonal();
  if (with_lines) {
    scale.head<3>().setConstant(scale.head<3>().mean());
    scale.tail<3>().setConstant(scale.tail<3>().mean());
  }
  return scale.cwiseMax(1e-6);
}

// Levenberg-Marquardt. Stops early where a step gains less than `gain` of the cost. Leaves the pose at the
// best state found.
void minimize(const Camera& camera, bool robust, int iterations, double gain, Tables& tables, SE3& T_cw) {
  constexpr double kFirstDamping = 1e-4, kMostDamping = 1e8, kSmallStep = 1e-10;
  Normal now, trial;
  tables.evaluate(camera, T_cw, robust, now);
  double damping = kFirstDamping;
  for (int i = 0; i < iterations && damping < kMostDamping; ++i) {
    Matrix6d h = hessian_matrix(now);
    h.diagonal() += damping * damping_scale(h, !tables.lines.blocks().empty());
    const Vector6d step = -h.ldlt().solve(Eigen::Map<const Vector6d>(now.gradient));
    if (!step.allFinite()) return;
    if (step.squaredNorm() < kSmallStep * kSmallStep) return;
    const SE3 T_trial = SE3::exp(step) * T_cw;
    tables.evaluate(camera, T_trial, robust, trial);
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

bool usable(const LineMatch& m) {
  const double direction2 = m.line_w.direction.squaredNorm();
  return sensible(m.line_w.moment.squaredNorm()) && std::abs(direction2 - 1.0) < 1e-6 &&
         sensible(m.start.squaredNorm()) && sensible(m.end.squaredNorm()) && std::isfinite(m.inverse_start) &&
         std::isfinite(m.inverse_end) && std::isfinite(m.sigma_start) && std::isfinite(m.sigma_end) &&
         m.sigma2 > 1e-9 && sensible(m.sigma2) && m.weight > 0.0 && sensible(m.weight);
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

// Whether both observed end points see the line before the camera.
bool in_view(const Camera& camera, const SE3& T_cw, const LineMatch& m) {
  const Line3 line_c = T_cw * m.line_w;
  return project_line(camera, line_c) && inverse_depth_at(camera, line_c, m.start) > 0.0 &&
         inverse_depth_at(camera, line_c, m.end) > 0.0;
}

// Components of a line's residual.
int rows(const LineTable& table, std::size_t i) {
  return 2 + static_cast<int>(table.get(i, kStartDepthInfo) > 0.0) +
         static_cast<int>(table.get(i, kEndDepthInfo) > 0.0);
}

void fill(const LineMatch& m, const DepthNoiseOptions& noise, std::size_t i, LineTable& table) {
  for (std::size_t k = 0; k < 3; ++k) {
    table.set(i, static_cast<LineField>(kMomentX + k), m.line_w.moment[static_cast<Eigen::Index>(k)]);
    table.set(i, static_cast<LineField>(kDirectionX + k), m.line_w.direction[static_cast<Eigen::Index>(k)]);
  }
  table.set(i, kStartU, m.start.x());
  table.set(i, kStartV, m.start.y());
  table.set(i, kEndU, m.end.x());
  table.set(i, kEndV, m.end.y());
  table.set(i, kLineInfo, 1.0 / m.sigma2);
  const auto set_depth = [&](double inverse, double sigma, LineField value, LineField info) {
    if (inverse * noise.max_depth < 1.0 || inverse * kMinProjectionDepth > 1.0) return;
    if (sigma <= 0.0) sigma = noise.inverse_depth_sigma;
    table.set(i, value, inverse);
    table.set(i, info, 1.0 / (sigma * sigma));
  };
  set_depth(m.inverse_start, m.sigma_start, kStartInverseDepth, kStartDepthInfo);
  set_depth(m.inverse_end, m.sigma_end, kEndInverseDepth, kEndDepthInfo);
  table.set(i, kLineHuber, std::sqrt(chi2_threshold(rows(table, i))));
}

// Sets one match's verdict; true where that changed it.
bool set_inlier(bool inlier, std::uint8_t& verdict, int& count) {
  const bool changed = verdict != static_cast<std::uint8_t>(inlier);
  verdict = inlier ? 1 : 0;
  count += verdict;
  return changed;
}

// Takes every usable match within the chi-square threshold for an inlier and lets only those weigh. True
// where that changed anything.
bool sort_matches(std::span<const PointMatch> points, std::span<const LineMatch> lines, Tables& tables,
                  PoseEstimate& estimate) {
  bool changed = false;
  estimate.inliers = estimate.line_inliers = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double huber = tables.points.get(i, kHuber);  // 0 for a match that cannot be used
    const bool inlier = huber > 0.0 && tables.points.get(i, kChi2) <= huber * huber;
    changed |= set_inlier(inlier, estimate.inlier[i], estimate.inliers);
    tables.points.set(i, kWeight, inlier ? points[i].weight : 0.0);
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool usable = tables.lines.get(i, kLineInfo) > 0.0;
    const bool inlier = usable && tables.lines.get(i, kLineChi2) <= chi2_threshold(rows(tables.lines, i));
    changed |= set_inlier(inlier, estimate.line_inlier[i], estimate.line_inliers);
    tables.lines.set(i, kLineWeight, inlier ? lines[i].weight : 0.0);
  }
  return changed;
}

}  // namespace

PoseOptimizer::PoseOptimizer(const Camera& camera, const DepthNoiseOptions& noise,
                             const PoseOptimizerOptions& options)
    : camera_(camera), noise_(noise), options_(options) {}

PoseEstimate PoseOptimizer::optimize(const SE3& T_cw, std::span<const PointMatch> points,
                                     std::span<const LineMatch> lines) const {
  const PoseEstimate nothing{.T_cw = T_cw,
                             .inlier = std::vector<std::uint8_t>(points.size(), 0),
                             .line_inlier = std::vector<std::uint8_t>(lines.size(), 0)};
  PoseEstimate estimate = nothing;
  Tables tables{MatchTable(points.size()), LineTable(lines.size())};
  int usable_matches = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!usable(points[i])) continue;
    fill(points[i], noise_, i, tables.points);
    if ((T_cw * points[i].point_w).z() < kMinProjectionDepth) continue;
    tables.points.set(i, kWeight, points[i].weight);
    ++usable_matches;
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!usable(lines[i])) continue;
    fill(lines[i], noise_, i, tables.lines);
    if (!in_view(camera_, T_cw, lines[i])) continue;
    tables.lines.set(i, kLineWeight, lines[i].weight);
    ++usable_matches;
  }
  if (usable_matches < kMinInliers) return nothing;

  Normal normal;
  for (int round = 0; round < options_.rounds; ++round) {
    // While outliers still pull, the exact minimum is not worth its steps.
    const bool robust = round < options_.robust_rounds;
    minimize(camera_, robust, options_.iterations, robust ? 1e-3 : 1e-6, tables, estimate.T_cw);
    tables.evaluate(camera_, estimate.T_cw, false, normal);
    const bool changed = sort_matches(points, lines, tables, estimate);
    if (estimate.inliers + estimate.line_inliers < kMinInliers) return nothing;
    if (!changed && !robust) break;
  }
  tables.evaluate(camera_, estimate.T_cw, false, normal);
  estimate.information = hessian_matrix(normal);
  return estimate;
}

double largest_deviation(const Matrix6d& information) {
  const double least =
      Eigen::SelfAdjointEigenSolver<Matrix6d>(information, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
  return least > 0.0 ? 1.0 / std::sqrt(least) : std::numeric_limits<double>::infinity();
}

}  // namespace ipl_slam
