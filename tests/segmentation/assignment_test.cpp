#include "segmentation/assignment.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

double total(const Eigen::MatrixXd& costs, const std::vector<int>& column) {
  double sum = 0.0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (column[i] >= 0) sum += costs(static_cast<Eigen::Index>(i), column[i]);
  }
  return sum;
}

// Over all ways to give the rows different columns; for at most as many rows as columns.
double least_total(const Eigen::MatrixXd& costs) {
  std::vector<int> order(static_cast<std::size_t>(costs.cols()));
  std::iota(order.begin(), order.end(), 0);
  double least = std::numeric_limits<double>::infinity();
  do {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < costs.rows(); ++i) sum += costs(i, order[static_cast<std::size_t>(i)]);
    least = std::min(least, sum);
  } while (std::next_permutation(order.begin(), order.end()));
  return least;
}

TEST(Assignment, IsTheBestOfAllOnSmallMatrices) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const auto rows = static_cast<Eigen::Index>(1 + random.index(6));
    const auto columns = static_cast<Eigen::Index>(1 + random.index(6));
    Eigen::MatrixXd costs(rows, columns);
    // Every other matrix of few different values: ties.
    for (double& cost : costs.reshaped()) {
      cost = trial % 2 == 0 ? random.uniform(-1.0, 1.0) : static_cast<double>(random.index(3));
    }
    const std::vector<int> column = assign(costs);
    std::vector<int> used = column;
    std::erase(used, -1);
    EXPECT_EQ(static_cast<Eigen::Index>(used.size()), std::min(rows, columns));
    std::sort(used.begin(), used.end());
    EXPECT_TRUE(std::adjacent_find(used.begin(), used.end()) == used.end()) << "a column was given twice";
    const double least = rows <= columns ? least_total(costs) : least_total(costs.transpose());
    EXPECT_NEAR(total(costs, column), least, 1e-12) << costs;
  }
}

TEST(Assignment, GivesUpTheBestPairForABetterWhole) {
  const Eigen::Matrix2d costs{{1.0, 2.0}, {2.0, 10.0}};
  EXPECT_EQ(assign(costs), (std::vector<int>{1, 0}));
}

TEST(Assignment, OfNothingIsNothing) {
  EXPECT_TRUE(assign(Eigen::MatrixXd(0, 3)).empty());
  EXPECT_EQ(assign(Eigen::MatrixXd(2, 0)), (std::vector<int>{-1, -1}));
}

}  // namespace
}  // namespace ipl_slam
