#include "tracking/pose_optimizer_kernel.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "geometry/reprojection.hpp"
#include "geometry/robust.hpp"

namespace ipl_slam::pose_kernel {
namespace {

const Camera kCamera{.fx = 517.0, .fy = 516.0, .cx = 318.0, .cy = 255.0};
const SE3 kPose = SE3::exp((Vector6d() << 0.1, -0.2, 0.3, 0.2, -0.1, 0.3).finished());

// Points on both sides of the camera, errors on both sides of Huber's threshold, some without depth or
// weight.
MatchTable table_of(std::size_t matches) {
  std::mt19937_64 engine(3);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(engine()) * 0x1.0p-64;
  };
  MatchTable table(matches);
  for (std::size_t i = 0; i < matches; ++i) {
    const Eigen::Vector3d p_c(uniform(-1, 1), uniform(-1, 1), uniform(-0.5, 4.0));
    const Eigen::Vector3d p_w = kPose.inverse() * p_c;
    const Eigen::Vector2d uv = kCamera.project(p_c) + Eigen::Vector2d(uniform(-4, 4), uniform(-4, 4));
    const double values[] = {p_w.x(), p_w.y(), p_w.z(), uv.x(), uv.y(), 1.0 / p_c.z() + uniform(-0.02, 0.02)};
    for (std::size_t f = kX; f <= kInverseDepth; ++f) table.set(i, static_cast<Field>(f), values[f]);
    table.set(i, kPixelInfo, uniform(0.2, 1.0));
    table.set(i, kDepthInfo, i % 3 == 0 ? 0.0 : 1e4);
    table.set(i, kHuber, std::sqrt(i % 3 == 0 ? kChi2For2Dof : kChi2For3Dof));
    table.set(i, kWeight, i % 7 == 0 ? 0.0 : uniform(0.1, 1.0));
  }
  return table;
}

// The same sums, match by match, straight from the formulas.
struct Reference {
  double cost = 0.0;
  Vector6d gradient = Vector6d::Zero();
  Matrix6d hessian = Matrix6d::Zero();
  std::vector<double> chi2;

  Reference(const MatchTable& table, std::size_t matches, bool robust) {
    for (std::size_t i = 0; i < matches; ++i) add(table, i, robust);
  }

  void add(const MatchTable& table, std::size_t i, bool robust) {
    const auto get = [&](Field f) { return table.get(i, f); };
    const Eigen::Vector3d p_c = kPose * Eigen::Vector3d(get(kX), get(kY), get(kZ));
    const double weight = get(kWeight);
    const auto rho = [&](double s) { return robust ? huber_cost(s, get(kHuber)) : s; };
    if (p_c.z() < kMinProjectionDepth) {
      chi2.push_back(kBehindCameraChi2);
      cost += rho(weight * kBehindCameraChi2);
      return;
    }
    PointResidual<double> r;
    point_residual(kCamera, p_c.x(), p_c.y(), p_c.z(), get(kU), get(kV), get(kInverseDepth), r);
    const Eigen::Vector3d e(r.e[0], r.e[1], r.e[2]), info(get(kPixelInfo), get(kPixelInfo), get(kDepthInfo));
    const Eigen::Map<const Eigen::Matrix<double, 3, 6, Eigen::RowMajor>> j(&r.jacobian[0][0]);
    chi2.push_back(e.dot(info.asDiagonal() * e));
    const double s = weight * chi2.back();
    const Eigen::Vector3d w = weight * (robust ? huber_weight(s, get(kHuber)) : 1.0) * info;
    cost += rho(s);
    gradient += j.transpose() * w.asDiagonal() * e;
    hessian += j.transpose() * w.asDiagonal() * j;
  }
};

TEST(PoseKernel, sums_what_the_formulas_say) {
  for (const bool robust : {false, true}) {
    for (const std::size_t matches : {1u, 4u, 101u}) {
      MatchTable table = table_of(matches);
      Normal sums;
      evaluate(kCamera, kPose, robust, table, sums);
      const Reference expected(table, matches, robust);
      // Only the order of additions differs: roundings of a hundred terms.
      EXPECT_NEAR(sums.cost, expected.cost, 1e-12 * (1.0 + expected.cost));
      const Eigen::Map<const Vector6d> gradient(sums.gradient);
      EXPECT_LT((gradient - expected.gradient).norm(), 1e-10 * (1.0 + expected.hessian.norm()));
      for (int r = 0; r < 6; ++r)
        for (int c = r; c < 6; ++c)
          EXPECT_NEAR(sums.hessian[upper(r, c)], expected.hessian(r, c),
                      1e-12 * (1.0 + expected.hessian.norm()));
      for (std::size_t i = 0; i < matches; ++i)
        EXPECT_NEAR(table.get(i, kChi2), expected.chi2[i], 1e-9 * (1.0 + expected.chi2[i])) << i;
    }
  }
}

TEST(PoseKernel, gives_the_same_bits_with_and_without_avx2) {
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "this processor has no AVX2 to compare with";
  for (const bool robust : {false, true}) {
    MatchTable wide = table_of(103), narrow = table_of(103);
    Normal a, b;
    evaluate(kCamera, kPose, robust, wide, a);
    evaluate_portable(kCamera, kPose, robust, narrow, b);
    EXPECT_EQ(a.cost, b.cost);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(a.gradient[i], b.gradient[i]) << i;
    for (int i = 0; i < 21; ++i) EXPECT_EQ(a.hessian[i], b.hessian[i]) << i;
    for (std::size_t i = 0; i < 103; ++i) EXPECT_EQ(wide.get(i, kChi2), narrow.get(i, kChi2)) << i;
  }
}

TEST(PoseKernel, packs_the_upper_triangle_row_by_row) {
  int expected = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) EXPECT_EQ(upper(r, c), expected++);
  EXPECT_EQ(expected, 21);
}

}  // namespace
}  // namespace ipl_slam::pose_kernel
