#include "tracking/pose_optimizer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "geometry/reprojection.hpp"
#include "geometry/robust.hpp"

namespace ipl_slam {
namespace {

constexpr int kMinInliers = 3;

// Four matches side by side. GCC and Clang map this type to one AVX register or to two SSE2 registers; every
// operation used is exactly rounded, so both give the same bits.
constexpr std::size_t kLanes = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using Mask = decltype(Lanes{} < Lanes{});

// The matches, one array per quantity, padded with unused ones to a multiple of kLanes.
enum Field : std::size_t {
  kX,
  kY,
  kZ,
  kU,
  kV,
  kInverseDepth,
  kPixelInfo,
  kDepthInfo,
  kHuber,
  kWeight,
  kChi2,
  kFields
};

// The alignment is spelled out because the compiler of a file without AVX takes 16 bytes to be enough for
// Lanes.
struct alignas(sizeof(Lanes)) Block {
  Lanes field[kFields];
};

class MatchTable {
 public:
  explicit MatchTable(std::size_t matches) : blocks_((matches + kLanes - 1) / kLanes, Block{}) {}

  [[nodiscard]] std::vector<Block>& blocks() { return blocks_; }
  [[nodiscard]] double get(std::size_t i, Field field) const {
    return blocks_[i / kLanes].field[field][i % kLanes];
  }
  void set(std::size_t i, Field field, double value) { blocks_[i / kLanes].field[field][i % kLanes] = value; }

 private:
  std::vector<Block> blocks_;
};

// Cost, gradient J^T W e and the upper triangle of J^T W J, row by row.
struct Normal {
  double cost = 0.0;
  double gradient[6] = {};
  double hessian[21] = {};
};

constexpr int upper(int row, int column) {
  return row * 6 - row * (row - 1) / 2 + column - row;
}

// Adds weight * row^T * (row, e), touching only the columns that can differ from zero.
template <std::size_t N>
[[gnu::always_inline]] inline void add_row(const std::array<int, N>& columns, const Lanes (&row)[6],
                                           const Lanes& e, const Lanes& weight, Lanes (&gradient)[6],
                                           Lanes (&hessian)[21]) {
#pragma GCC unroll 6
  for (std::size_t r = 0; r < N; ++r) {
    const Lanes weighted = weight * row[columns[r]];
    gradient[columns[r]] += weighted * e;
#pragma GCC unroll 6
    for (std::size_t c = r; c < N; ++c) hessian[upper(columns[r], columns[c])] += weighted * row[columns[c]];
  }
}

// Evaluates all matches at T_cw, stores their unweighted chi-square, and sums the normal equations lane by
// lane: the order of additions is part of the result.
[[gnu::always_inline]] inline void evaluate_lanes(const Camera& camera, const SE3& T_cw, bool robust,
                                                  MatchTable& table, Normal& out) {
  const Eigen::Matrix3d R = T_cw.rotation_matrix();
  const Eigen::Vector3d t = T_cw.translation();
  Lanes cost{}, gradient[6]{}, hessian[21]{};
  const Lanes zero{}, one = zero + 1.0, behind_chi2 = zero + kBehindCameraChi2;
  for (Block& block : table.blocks()) {
    Lanes(&m)[kFields] = block.field;
    const Lanes x = R(0, 0) * m[kX] + R(0, 1) * m[kY] + R(0, 2) * m[kZ] + t[0];
    const Lanes y = R(1, 0) * m[kX] + R(1, 1) * m[kY] + R(1, 2) * m[kZ] + t[1];
    const Lanes z = R(2, 0) * m[kX] + R(2, 1) * m[kY] + R(2, 2) * m[kZ] + t[2];
    const Mask in_front = z >= kMinProjectionDepth;
    PointResidual<Lanes> r;
    const Lanes z_safe = in_front ? z : one;
    point_residual(camera, x, y, z_safe, m[kU], m[kV], m[kInverseDepth], r);
    const Lanes seen =
        r.e[0] * r.e[0] * m[kPixelInfo] + r.e[1] * r.e[1] * m[kPixelInfo] + r.e[2] * r.e[2] * m[kDepthInfo];
    const Lanes chi2 = in_front ? seen : behind_chi2;
    m[kChi2] = chi2;

    Lanes weight = in_front ? m[kWeight] : zero;
    Lanes loss = m[kWeight] * chi2;
    if (robust) {  // rho(s) and rho'(s) of Huber's kernel, as in robust.hpp
      const Lanes delta = m[kHuber], inside = delta * delta;
      const Lanes s = loss;
      Lanes root = s > inside ? s : one;
      for (std::size_t l = 0; l < kLanes; ++l) root[l] = __builtin_sqrt(root[l]);
      loss = s > inside ? 2.0 * delta * root - inside : s;
      weight *= s > inside ? delta / root : one;
    }
    cost += loss;
    const Lanes pixel_weight = weight * m[kPixelInfo];
    add_row(kColumnsU, r.jacobian[0], r.e[0], pixel_weight, gradient, hessian);
    add_row(kColumnsV, r.jacobian[1], r.e[1], pixel_weight, gradient, hessian);
    add_row(kColumnsD, r.jacobian[2], r.e[2], weight * m[kDepthInfo], gradient, hessian);
  }
  const auto sum = [](const Lanes& v) __attribute__((always_inline)) {
    return (v[0] + v[1]) + (v[2] + v[3]);
  };
  out.cost = sum(cost);
  for (int i = 0; i < 6; ++i) out.gradient[i] = sum(gradient[i]);
  for (int i = 0; i < 21; ++i) out.hessian[i] = sum(hessian[i]);
}

void evaluate_portable(const Camera& camera, const SE3& T_cw, bool robust, MatchTable& table, Normal& out) {
  evaluate_lanes(camera, T_cw, robust, table, out);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) void evaluate_avx2(const Camera& camera, const SE3& T_cw, bool robust,
                                                   MatchTable& table, Normal& out) {
  evaluate_lanes(camera, T_cw, robust, table, out);
}
#endif

void evaluate(const Camera& camera, const SE3& T_cw, bool robust, MatchTable& table, Normal& out) {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2");
  if (avx2) return evaluate_avx2(camera, T_cw, robust, table, out);
#endif
  evaluate_portable(camera, T_cw, robust, table, out);
}

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
