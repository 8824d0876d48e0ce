#include "tracking/pose_optimizer_line_kernel.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "../geometry/numeric_diff.hpp"
#include "common/random.hpp"
#include "geometry/line3.hpp"
#include "geometry/line_reprojection.hpp"
#include "geometry/reprojection.hpp"
#include "geometry/robust.hpp"

namespace ipl_slam::pose_kernel {
namespace {

const Camera kCamera{.fx = 517.0, .fy = 516.0, .cx = 318.0, .cy = 255.0};
const SE3 kPose = SE3::exp((Vector6d() << 0.1, -0.2, 0.3, 0.2, -0.1, 0.3).finished());

struct Sight {
  Line3 line_w;
  Eigen::Vector2d start, end;
  double info, weight;
  Eigen::Vector2d inverse_depth = Eigen::Vector2d::Zero(), depth_info = Eigen::Vector2d::Zero();  // per end
};

int rows(const Sight& s) {
  return 2 + static_cast<int>((s.depth_info.array() > 0.0).count());
}

// Lines with measured depth at one end, at both or at none; on both sides of the camera, errors on both sides
// of Huber's threshold, some without weight, and one through the camera's centre.
std::vector<Sight> sights(std::size_t count) {
  Random random(3);
  std::vector<Sight> result;
  while (result.size() < count) {
    const std::size_t i = result.size();
    const auto point = [&] {
      const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
      return Eigen::Vector3d(x, y, i % 6 == 5 ? -2.0 : random.uniform(0.8, 4.0));
    };
    const Eigen::Vector3d a = point(), b = i % 11 == 7 ? Eigen::Vector3d(2.0 * a) : point();
    const auto noise = [&] {
      const double du = random.uniform(-4, 4), dv = random.uniform(-4, 4);
      return Eigen::Vector2d(du, dv);
    };
    const SE3 T_wc = kPose.inverse();
    const auto line = Line3::through(T_wc * a, T_wc * b);
    result.push_back({*line, kCamera.project(a) + noise(), kCamera.project(b) + noise(), 0.0, 0.0});
    result.back().info = random.uniform(0.2, 1.0);
    result.back().weight = i % 7 == 0 ? 0.0 : random.uniform(0.1, 1.0);
    for (const int end : {0, 1}) {
      if (i % 5 == 0 || (i + static_cast<std::size_t>(end)) % 4 == 0 || b.z() < 0.0) continue;
      result.back().inverse_depth[end] = 1.0 / (end == 0 ? a : b).z() + random.uniform(-0.04, 0.04);
      result.back().depth_info[end] = 1.0 / std::pow(random.uniform(0.005, 0.03), 2);
    }
  }
  return result;
}

LineTable table_of(const std::vector<Sight>& sights) {
  LineTable table(sights.size());
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const Sight& s = sights[i];
    const Eigen::Vector3d &n = s.line_w.moment, &d = s.line_w.direction;
    const double values[] = {n.x(),
                             n.y(),
                             n.z(),
                             d.x(),
                             d.y(),
                             d.z(),
                             s.start.x(),
                             s.start.y(),
                             s.end.x(),
                             s.end.y(),
                             s.info,
                             s.inverse_depth[0],
                             s.inverse_depth[1],
                             s.depth_info[0],
                             s.depth_info[1],
                             std::sqrt(chi2_threshold(rows(s))),
                             s.weight};
    for (std::size_t f = kMomentX; f <= kLineWeight; ++f) table.set(i, static_cast<LineField>(f), values[f]);
  }
  return table;
}

// All residuals, those of depth 0 where there is none, by way of project_line() and inverse_depth_at():
// nothing of the formulas under test.
Eigen::Vector4d residual(const SE3& T_cw, const Sight& s) {
  const Line3 line_c = T_cw * s.line_w;
  const ImageLine l = project_line(kCamera, line_c).value();
  const auto depth = [&](int end, const Eigen::Vector2d& uv) {
    return s.depth_info[end] > 0.0 ? s.inverse_depth[end] - inverse_depth_at(kCamera, line_c, uv) : 0.0;
  };
  return {signed_distance(l, s.start), signed_distance(l, s.end), depth(0, s.start), depth(1, s.end)};
}

bool in_view(const Sight& s) {
  const Line3 line_c = kPose * s.line_w;
  return line_c.moment.norm() > kMinLineDistance && inverse_depth_at(kCamera, line_c, s.start) > 0.0 &&
         inverse_depth_at(kCamera, line_c, s.end) > 0.0;
}

// The same sums, line by line, with numeric derivatives.
struct Reference {
  double cost = 0.0;
  Vector6d gradient = Vector6d::Zero();
  Matrix6d hessian = Matrix6d::Zero();
  std::vector<double> chi2;

  Reference(const std::vector<Sight>& sights, bool robust) {
    for (const Sight& s : sights) add(s, robust);
  }

  void add(const Sight& s, bool robust) {
    const double delta = std::sqrt(chi2_threshold(rows(s)));
    const auto rho = [&](double error) { return robust ? huber_cost(error, delta) : error; };
    if (!in_view(s)) {
      chi2.push_back(kBehindCameraChi2);
      cost += rho(s.weight * kBehindCameraChi2);
      return;
    }
    const Eigen::Vector4d e = residual(kPose, s), info(s.info, s.info, s.depth_info[0], s.depth_info[1]);
    const Eigen::Matrix<double, 4, 6> j = testing::numeric_jacobian<4, 6>(
        [&](const Vector6d& xi) { return residual(SE3::exp(xi) * kPose, s); });
    chi2.push_back(e.dot(info.cwiseProduct(e)));
    const double error = s.weight * chi2.back();
    const Eigen::Vector4d w = s.weight * (robust ? huber_weight(error, delta) : 1.0) * info;
    cost += rho(error);
    gradient += j.transpose() * w.cwiseProduct(e);
    hessian += j.transpose() * w.asDiagonal() * j;
  }
};

TEST(PoseLineKernel, SumsWhatTheFormulasSayWithTheirDerivatives) {
  for (const bool robust : {false, true}) {
    for (const std::size_t count : {1U, 4U, 101U}) {
      const std::vector<Sight> lines = sights(count);
      LineTable table = table_of(lines);
      Normal sums;
      evaluate_lines(kCamera, kPose, robust, table, sums);
      const Reference expected(lines, robust);
      EXPECT_NEAR(sums.cost, expected.cost, 1e-11 * (1.0 + expected.cost));
      // Numeric derivatives are good to 1e-8 of their scale.
      const double scale = 1.0 + expected.hessian.norm();
      const Eigen::Map<const Vector6d> gradient(sums.gradient);
      EXPECT_LT((gradient - expected.gradient).norm(), 1e-7 * scale);
      for (int r = 0; r < 6; ++r)
        for (int c = r; c < 6; ++c)
          EXPECT_NEAR(sums.hessian[upper(r, c)], expected.hessian(r, c), 1e-7 * scale) << r << c;
      for (std::size_t i = 0; i < count; ++i)
        EXPECT_NEAR(table.get(i, kLineChi2), expected.chi2[i], 1e-9 * (1.0 + expected.chi2[i])) << i;
    }
  }
}

TEST(PoseLineKernel, ALineWithoutDepthGivesTheSameBitsBesideOneWithDepth) {
  std::vector<Sight> lines = sights(4);
  for (Sight& s : lines) s.weight = 0.0, s.inverse_depth.setZero(), s.depth_info.setZero();
  lines[1].weight = 0.7;
  for (const bool robust : {false, true}) {
    LineTable alone = table_of(lines);
    Normal expected, sums;
    evaluate_lines(kCamera, kPose, robust, alone, expected);
    std::vector<Sight> with = lines;
    with[2].inverse_depth = {0.4, 0.5}, with[2].depth_info = {1e4, 1e4};
    LineTable beside = table_of(with);
    evaluate_lines(kCamera, kPose, robust, beside, sums);
    EXPECT_GT(sums.cost, 0.0);
    EXPECT_EQ(sums.cost, expected.cost);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(sums.gradient[i], expected.gradient[i]) << i;
    for (int i = 0; i < 21; ++i) EXPECT_EQ(sums.hessian[i], expected.hessian[i]) << i;
    EXPECT_EQ(beside.get(1, kLineChi2), alone.get(1, kLineChi2));
    EXPECT_GT(beside.get(2, kLineChi2), alone.get(2, kLineChi2)) << "its depth is off";
  }
}

TEST(PoseLineKernel, AddsToWhatIsThere) {
  LineTable table = table_of(sights(10));
  Normal once, twice;
  evaluate_lines(kCamera, kPose, true, table, once);
  for (int i = 0; i < 2; ++i) evaluate_lines(kCamera, kPose, true, table, twice);
  EXPECT_GT(once.cost, 0.0);
  EXPECT_EQ(twice.cost, 2.0 * once.cost);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(twice.gradient[i], 2.0 * once.gradient[i]);
  for (int i = 0; i < 21; ++i) EXPECT_EQ(twice.hessian[i], 2.0 * once.hessian[i]);
}

TEST(PoseLineKernel, ALineThroughTheCentreOrBehindTheCameraWeighsNothing) {
  const auto line_of = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const SE3 T_wc = kPose.inverse();
    return Sight{*Line3::through(T_wc * a, T_wc * b), {300, 200}, {350, 300}, 1.0, 1.0};
  };
  const std::vector<Sight> lines = {line_of({0.1, 0.2, 1.0}, {0.2, 0.4, 2.0}),      // through the centre
                                    line_of({-0.1, -0.2, -1.0}, {0.1, 0.2, -1.0}),  // behind
                                    line_of({0.0, 1.0, 0.0}, {1.0, 1.0, 0.0})};     // in the camera's plane
  LineTable table = table_of(lines);
  Normal sums;
  evaluate_lines(kCamera, kPose, false, table, sums);
  EXPECT_EQ(sums.cost, 3.0 * kBehindCameraChi2);
  for (const double g : sums.gradient) EXPECT_EQ(g, 0.0);
  for (const double h : sums.hessian) EXPECT_EQ(h, 0.0);
  for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(table.get(i, kLineChi2), kBehindCameraChi2) << i;
}

TEST(PoseLineKernel, GivesTheSameBitsWithAndWithoutAvx2) {
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "this processor has no AVX2 to compare with";
  for (const bool robust : {false, true}) {
    LineTable wide = table_of(sights(103)), narrow = table_of(sights(103));
    Normal a, b;
    evaluate_lines(kCamera, kPose, robust, wide, a);
    evaluate_lines_portable(kCamera, kPose, robust, narrow, b);
    EXPECT_EQ(a.cost, b.cost);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(a.gradient[i], b.gradient[i]) << i;
    for (int i = 0; i < 21; ++i) EXPECT_EQ(a.hessian[i], b.hessian[i]) << i;
    for (std::size_t i = 0; i < 103; ++i) EXPECT_EQ(wide.get(i, kLineChi2), narrow.get(i, kLineChi2)) << i;
  }
}

}  // namespace
}  // namespace ipl_slam::pose_kernel
