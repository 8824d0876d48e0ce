#include "geometry/perspective_three_point.hpp"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

using Triple = std::array<Eigen::Vector3d, 3>;

Triple rays_to(const Triple& points) {
  return {points[0].normalized(), points[1].normalized(), points[2].normalized()};
}

// Difference between the true distances and the nearest solution, m.
double error(const Triple& points_c) {
  const Eigen::Vector3d truth(points_c[0].norm(), points_c[1].norm(), points_c[2].norm());
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& s : three_point_distances(points_c, rays_to(points_c))) {
    least = std::min(least, (s - truth).norm());
  }
  return least;
}

TEST(PerspectiveThreePoint, FindsTheTrueDistancesOfRandomTriangles) {
  Random random(7);
  int good = 0;
  for (int i = 0; i < 1000; ++i) {
    Triple points;
    for (auto& p : points) p = {random.uniform(-2, 2), random.uniform(-1.5, 1.5), random.uniform(0.5, 6)};
    if (error(points) < 1e-6) ++good;
  }
  // Where two solutions nearly fall together the roots have half of a double's digits, and a few are lost.
  EXPECT_GE(good, 995);
}

TEST(PerspectiveThreePoint, EverySolutionSeesTheTriangleAsItIs) {
  Random random(8);
  std::size_t most = 0;
  for (int i = 0; i < 300; ++i) {
    Triple points;
    for (auto& p : points) p = {random.uniform(-2, 2), random.uniform(-1.5, 1.5), random.uniform(0.5, 6)};
    const Triple rays = rays_to(points);
    const auto solutions = three_point_distances(points, rays);
    most = std::max(most, solutions.size());
    for (const Eigen::Vector3d& s : solutions) {
      for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3;
        EXPECT_NEAR((s[a] * rays[a] - s[b] * rays[b]).norm(), (points[a] - points[b]).norm(), 1e-4);
      }
    }
  }
  EXPECT_GE(most, 2U);
  EXPECT_LE(most, 4U);
}

TEST(PerspectiveThreePoint, SolvesTheEquilateralTriangleSeenFromItsAxis) {
  // The textbook case with a double root.
  const Triple points{Eigen::Vector3d(1.0, 0.0, 2.0), Eigen::Vector3d(-0.5, 0.8660254037844386, 2.0),
                      Eigen::Vector3d(-0.5, -0.8660254037844386, 2.0)};
  EXPECT_LT(error(points), 1e-3);
}

TEST(PerspectiveThreePoint, HasNoAnswerWherePointsFallTogetherOrNumbersAreNone) {
  const Triple same{Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(1, 0, 2)};
  EXPECT_TRUE(three_point_distances(same, rays_to(same)).empty());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Triple broken{Eigen::Vector3d(nan, 0, 2), Eigen::Vector3d(0, 1, 2), Eigen::Vector3d(1, 0, 2)};
  EXPECT_TRUE(three_point_distances(broken, rays_to(broken)).empty());
}

}  // namespace
}  // namespace ipl_slam
