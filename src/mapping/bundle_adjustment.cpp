#include "mapping/bundle_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <span>
#include <stdexcept>

#include <ceres/ceres.h>

#include "geometry/robust.hpp"
#include "mapping/abort_callback.hpp"
#include "mapping/bundle_adjustment_costs.hpp"
#include "mapping/bundle_adjustment_lines.hpp"

namespace ipl_slam {
namespace {

// Up to this many free poses the reduced camera system is factorised as a dense matrix; beyond it, where most
// pairs of poses share no point, as a sparse one.
constexpr int kMostDensePoses = 60;

// A step that gains less than this share of the cost is the last of its phase. While outliers still pull, the
// exact minimum is not worth its steps.
constexpr double kRobustGain = 1e-3, kFinalGain = 1e-6;

void check_indices(const BundleProblem& problem) {
  bool right = true;
  for (const auto& o : problem.observations)
    right = right && o.pose < problem.poses.size() && o.point < problem.points.size();
  for (const auto& o : problem.line_observations)
    right = right && o.pose < problem.poses.size() && o.line < problem.lines.size();
  if (!right)
    throw std::out_of_range("adjust_bundle: an observation's index lies outside the poses, points or lines");
}

class Adjustment {
 public:
  Adjustment(BundleProblem& problem, const Camera& camera, const DepthNoiseOptions& noise,
             const std::atomic<bool>* abort)
      : problem_(problem),
        camera_(camera),
        noise_(noise),
        abort_(abort),
        landmarks_(problem.points),
        lines_(problem, camera, noise, add_line_blocks()),
        ceres_(problem_options()) {
    build();
  }

  BundleResult run(const BundleOptions& options);

 private:
  static ceres::Problem::Options problem_options() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    return options;
  }

  std::span<Eigen::Vector3d> add_line_blocks();
  void build();
  void add_residual(std::size_t index);
  void solve(int iterations, double gain, BundleResult& result);
  void take_outliers_out(const BundleResult& result);
  void write_back(const BundleResult& result);

  [[nodiscard]] bool has_depth(const BundleProblem::Observation& o) const {
    return o.depth >= kMinProjectionDepth && o.depth <= noise_.max_depth;
  }
  [[nodiscard]] bool usable(const BundleProblem::Observation& o) const;
  [[nodiscard]] double chi2(const BundleProblem::Observation& o) const;
  double classify(BundleResult& result) const;
  double classify_points(std::vector<std::uint8_t>& outlier) const;

  BundleProblem& problem_;
  const Camera& camera_;
  const DepthNoiseOptions& noise_;
  AbortCallback abort_;

  std::vector<PoseBlock> poses_;
  // The points, then two vectors per line. Ceres orders the blocks that it eliminates by their addresses, and
  // only within one array do these not depend on the allocator.
  std::vector<Eigen::Vector3d> landmarks_;
  std::deque<PointCost<2>> pixel_costs_;  // Ceres keeps pointers to them: a deque's elements do not move
  std::deque<PointCost<3>> depth_costs_;
  std::vector<ceres::ResidualBlockId> residuals_;  // per observation, null where it takes no part
  BundleLines lines_;
  int free_poses_ = 0;

  SE3Manifold manifold_;
  ceres::HuberLoss huber2_{std::sqrt(kChi2For2Dof)}, huber3_{std::sqrt(kChi2For3Dof)};
  ceres::Problem ceres_;  // last: it refers to everything above
};

bool Adjustment::usable(const BundleProblem::Observation& o) const {
  const Eigen::Vector3d& p = problem_.points[o.point];
  const SE3& T_cw = problem_.poses[o.pose].T_cw;
  return sensible(p.x()) && sensible(p.y()) && sensible(p.z()) && sensible(o.uv.x()) && sensible(o.uv.y()) &&
         std::isfinite(o.depth) && o.sigma2 > 1e-9 && sensible(o.sigma2) && o.weight > 0.0 &&
         sensible(o.weight) && T_cw.rotation().coeffs().allFinite() && T_cw.translation().allFinite() &&
         (T_cw * p).z() >= kMinProjectionDepth;
}

std::span<Eigen::Vector3d> Adjustment::add_line_blocks() {
  const std::size_t points = landmarks_.size();
  landmarks_.resize(points + 2 * problem_.lines.size());
  return std::span(landmarks_).subspan(points);
}

void Adjustment::build() {
  const auto& observations = problem_.observations;
  poses_.resize(problem_.poses.size());
  for (std::size_t i = 0; i < poses_.size(); ++i) to_pose_block(problem_.poses[i].T_cw, poses_[i].data());
  residuals_.resize(observations.size(), nullptr);
  for (std::size_t i = 0; i < observations.size(); ++i)
    if (usable(observations[i])) add_residual(i);
  lines_.add_to(ceres_, poses_);

  const bool gauge_free =
      std::none_of(problem_.poses.begin(), problem_.poses.end(), [](const auto& pose) { return pose.fixed; });
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (!ceres_.HasParameterBlock(poses_[i].data())) continue;
    if (problem_.poses[i].fixed || (gauge_free && i == 0)) {
      ceres_.SetParameterBlockConstant(poses_[i].data());
    } else {
      ceres_.SetManifold(poses_[i].data(), &manifold_);
      ++free_poses_;
    }
  }
}

void Adjustment::add_residual(std::size_t index) {
  const auto& o = problem_.observations[index];
  double* pose = poses_[o.pose].data();
  double* point = landmarks_[o.point].data();
  if (has_depth(o)) {
    depth_costs_.emplace_back(camera_, noise_, o);
    residuals_[index] = ceres_.AddResidualBlock(&depth_costs_.back(), &huber3_, pose, point);
  } else {
    pixel_costs_.emplace_back(camera_, noise_, o);
    residuals_[index] = ceres_.AddResidualBlock(&pixel_costs_.back(), &huber2_, pose, point);
  }
}

double Adjustment::chi2(const BundleProblem::Observation& o) const {
  const Eigen::Vector3d p_c = from_pose_block(poses_[o.pose].data()) * landmarks_[o.point];
  if (!(p_c.z() >= kMinProjectionDepth)) return kBehindCameraChi2;
  PointResidual<double> r;
  point_residual(camera_, p_c.x(), p_c.y(), p_c.z(), o.uv.x(), o.uv.y(), has_depth(o) ? 1.0 / o.depth : 0.0,
                 r);
  const double pixels = (r.e[0] * r.e[0] + r.e[1] * r.e[1]) / o.sigma2;
  const double e_d = r.e[2] / noise_.inverse_depth_sigma;
  return has_depth(o) ? pixels + e_d * e_d : pixels;
}

// Sorts all observations at the current state and returns the robust cost of those that were usable at the
// start, whether they take part any more or not: so costs before and after can be compared.
double Adjustment::classify(BundleResult& result) const {
  return classify_points(result.outlier) + lines_.classify(poses_, result.line_outlier);
}

double Adjustment::classify_points(std::vector<std::uint8_t>& outlier) const {
  const auto& observations = problem_.observations;
  outlier.assign(observations.size(), 1);
  double cost = 0.0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const auto& o = observations[i];
    if (!usable(o)) continue;
    const double s = chi2(o), threshold = has_depth(o) ? kChi2For3Dof : kChi2For2Dof;
    outlier[i] = s <= threshold ? 0 : 1;
    cost += 0.5 * huber_cost(o.weight * s, std::sqrt(threshold));
  }
  return cost;
}

// Stops early where a step gains less than `gain` of the cost.
void Adjustment::solve(int iterations, double gain, BundleResult& result) {
  ceres::Solver::Options options;
  options.linear_solver_type = free_poses_ <= kMostDensePoses ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // CHOLMOD, the default, is partly GPL
  options.dense_linear_algebra_library_type = ceres::EIGEN;
  options.max_num_iterations = iterations;
  options.function_tolerance = gain;
  // With more threads Ceres sums costs, gradients and the Schur complement in the order in which threads
  // finish.
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(&abort_);
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t i = 0; i < problem_.points.size(); ++i)
    if (ceres_.HasParameterBlock(landmarks_[i].data()))
      options.linear_solver_ordering->AddElementToGroup(landmarks_[i].data(), 0);
  lines_.order(ceres_, *options.linear_solver_ordering);
  for (auto& pose : poses_)
    if (ceres_.HasParameterBlock(pose.data()))
      options.linear_solver_ordering->AddElementToGroup(pose.data(), 1);

  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_, &summary);
  result.iterations +=
      std::max(0, static_cast<int>(summary.iterations.size()) - 1);  // the first is the start value
  result.aborted = abort_.raised();
}

void Adjustment::take_outliers_out(const BundleResult& result) {
  for (std::size_t i = 0; i < residuals_.size(); ++i) {
    if (!result.outlier[i] || !residuals_[i]) continue;
    ceres_.RemoveResidualBlock(residuals_[i]);
    residuals_[i] = nullptr;
  }
  lines_.take_out(result.line_outlier, ceres_);
}

// What no inlier speaks for stays where it was.
void Adjustment::write_back(const BundleResult& result) {
  std::vector<std::uint8_t> pose_seen(poses_.size(), 0), point_seen(problem_.points.size(), 0);
  for (std::size_t i = 0; i < result.outlier.size(); ++i) {
    if (result.outlier[i]) continue;
    pose_seen[problem_.observations[i].pose] = 1;
    point_seen[problem_.observations[i].point] = 1;
  }
  for (std::size_t i = 0; i < result.line_outlier.size(); ++i)
    if (!result.line_outlier[i]) pose_seen[problem_.line_observations[i].pose] = 1;
  for (std::size_t i = 0; i < poses_.size(); ++i)
    if (pose_seen[i] && ceres_.HasParameterBlock(poses_[i].data()) &&
        !ceres_.IsParameterBlockConstant(poses_[i].data()))
      problem_.poses[i].T_cw = from_pose_block(poses_[i].data());
  for (std::size_t i = 0; i < problem_.points.size(); ++i)
    if (point_seen[i]) problem_.points[i] = landmarks_[i];
  lines_.write_back(result.line_outlier, problem_.lines);
}

BundleResult Adjustment::run(const BundleOptions& options) {
  BundleResult result;
  result.initial_cost = classify(result);
  result.final_cost = result.initial_cost;
  result.aborted = abort_.raised();
  if (result.aborted || ceres_.NumResidualBlocks() == 0) return result;
  solve(options.robust_iterations, kRobustGain, result);
  result.final_cost = classify(result);
  if (!result.aborted && options.final_iterations > 0) {
    take_outliers_out(result);
    if (ceres_.NumResidualBlocks() > 0) solve(options.final_iterations, kFinalGain, result);
    result.final_cost = classify(result);
  }
  write_back(result);
  return result;
}

}  // namespace

BundleResult adjust_bundle(BundleProblem& problem, const Camera& camera, const DepthNoiseOptions& noise,
                           const BundleOptions& options, const std::atomic<bool>* abort) {
  check_indices(problem);
  return Adjustment(problem, camera, noise, abort).run(options);
}

}  // namespace ipl_slam
