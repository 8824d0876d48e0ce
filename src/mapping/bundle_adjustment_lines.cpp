#include "mapping/bundle_adjustment_lines.hpp"

#include <cmath>

#include "geometry/robust.hpp"
#include "mapping/bundle_adjustment_costs.hpp"
#include "mapping/bundle_adjustment_line_cost.hpp"

namespace ipl_slam {
namespace {

// A direction or moment that misses its length or its right angle by more, as a share, is no line.
constexpr double kUnitTolerance = 1e-6;

bool usable(const BundleProblem::LineObservation& o) {
  return sensible(o.start.x()) && sensible(o.start.y()) && sensible(o.end.x()) && sensible(o.end.y()) &&
         std::isfinite(o.inverse_start) && std::isfinite(o.inverse_end) && std::isfinite(o.sigma_start) &&
         std::isfinite(o.sigma_end) && o.sigma2 > 1e-9 && sensible(o.sigma2) && o.weight > 0.0 &&
         sensible(o.weight);
}

bool usable(const Line3& line) {
  const Eigen::Vector3d &n = line.moment, &d = line.direction;
  return sensible(n.x()) && sensible(n.y()) && sensible(n.z()) && std::abs(d.norm() - 1.0) < kUnitTolerance &&
         std::abs(n.dot(d)) <= kUnitTolerance * (1.0 + n.norm());
}

bool usable(const SE3& pose) {
  return pose.rotation().coeffs().allFinite() && pose.translation().allFinite();
}

// Null where the observation cannot be used.
std::unique_ptr<ceres::CostFunction> make_cost(const BundleProblem& problem,
                                               const BundleProblem::LineObservation& o, const Camera& camera,
                                               const DepthNoiseOptions& noise) {
  const SE3& T_cw = problem.poses[o.pose].T_cw;
  const Line3& line_w = problem.lines[o.line];
  if (!usable(o) || !usable(line_w) || !usable(T_cw)) return nullptr;
  const auto sigma = [&](double own) { return own > 0.0 ? own : noise.inverse_depth_sigma; };
  std::array<LineEnd, 2> ends{
      {{o.start, o.inverse_start, sigma(o.sigma_start)}, {o.end, o.inverse_end, sigma(o.sigma_end)}}};
  if (!shows_at(camera, T_cw * line_w, ends)) return nullptr;

  const auto has_depth = [&](const LineEnd& end) {
    return end.inverse_depth * noise.max_depth >= 1.0 && end.inverse_depth * kMinProjectionDepth <= 1.0;
  };
  if (!has_depth(ends[0])) std::swap(ends[0], ends[1]);
  if (!has_depth(ends[0])) return std::make_unique<LineCost<2>>(camera, ends, o.sigma2, o.weight);
  if (!has_depth(ends[1])) return std::make_unique<LineCost<3>>(camera, ends, o.sigma2, o.weight);
  return std::make_unique<LineCost<4>>(camera, ends, o.sigma2, o.weight);
}

// Squared residual in standard deviations, weight included.
double weighted_chi2(const ceres::CostFunction& cost, const double* pose, const double* line) {
  const double* blocks[] = {pose, line};
  double e[4];
  cost.Evaluate(blocks, e, nullptr);
  return Eigen::Map<const Eigen::VectorXd>(e, cost.num_residuals()).squaredNorm();
}

}  // namespace

BundleLines::BundleLines(const BundleProblem& problem, const Camera& camera, const DepthNoiseOptions& noise,
                         std::span<Eigen::Vector3d> blocks)
    : observations_(problem.line_observations), blocks_(blocks), residuals_(observations_.size(), nullptr) {
  for (std::size_t i = 0; i < problem.lines.size(); ++i) to_line_block(problem.lines[i], line(i));
  for (const auto& o : observations_) costs_.push_back(make_cost(problem, o, camera, noise));
  for (const int rows : {2, 3, 4})
    losses_.push_back(std::make_unique<ceres::HuberLoss>(std::sqrt(chi2_threshold(rows))));
}

void BundleLines::add_to(ceres::Problem& ceres, std::vector<PoseBlock>& poses) {
  for (std::size_t i = 0; i < costs_.size(); ++i) {
    if (!costs_[i]) continue;
    const auto& o = observations_[i];
    ceres::LossFunction* loss = losses_[static_cast<std::size_t>(costs_[i]->num_residuals() - 2)].get();
    residuals_[i] = ceres.AddResidualBlock(costs_[i].get(), loss, poses[o.pose].data(), line(o.line));
    if (!ceres.HasManifold(line(o.line))) ceres.SetManifold(line(o.line), &manifold_);
  }
}

void BundleLines::order(const ceres::Problem& ceres, ceres::ParameterBlockOrdering& ordering) const {
  for (std::size_t i = 0; 2 * i < blocks_.size(); ++i)
    if (ceres.HasParameterBlock(line(i))) ordering.AddElementToGroup(line(i), 0);
}

double BundleLines::classify(const std::vector<PoseBlock>& poses, std::vector<std::uint8_t>& outlier) const {
  outlier.assign(observations_.size(), 1);
  double cost = 0.0;
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (!costs_[i]) continue;
    const auto& o = observations_[i];
    const double s = weighted_chi2(*costs_[i], poses[o.pose].data(), line(o.line));
    const double limit = chi2_threshold(costs_[i]->num_residuals());
    outlier[i] = s <= o.weight * limit ? 0 : 1;
    cost += 0.5 * huber_cost(s, std::sqrt(limit));
  }
  return cost;
}

void BundleLines::take_out(const std::vector<std::uint8_t>& outlier, ceres::Problem& ceres) {
  for (std::size_t i = 0; i < residuals_.size(); ++i) {
    if (!outlier[i] || !residuals_[i]) continue;
    ceres.RemoveResidualBlock(residuals_[i]);
    residuals_[i] = nullptr;
  }
}

void BundleLines::write_back(const std::vector<std::uint8_t>& outlier, std::vector<Line3>& lines) const {
  std::vector<std::uint8_t> seen(lines.size(), 0);
  for (std::size_t i = 0; i < outlier.size(); ++i)
    if (!outlier[i]) seen[observations_[i].line] = 1;
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (seen[i]) lines[i] = from_line_block(line(i));
}

}  // namespace ipl_slam
