#include "segmentation/assignment.hpp"

#include <limits>

#include <opencv2/core.hpp>

namespace ipl_slam {
namespace {

constexpr int kNone = -1;

// Every row gets a column; there are at least as many columns as rows. Row after row is added, along the
// cheapest path that alternates between unused and used pairs; prices keep all reduced costs
// cost(i, j) - row_price(i) - column_price(j) at 0 or above, and at 0 for pairs that are used.
std::vector<int> assign_all_rows(const Eigen::MatrixXd& costs) {
  const int rows = static_cast<int>(costs.rows()), columns = static_cast<int>(costs.cols());
  std::vector<double> row_price(rows, 0.0), column_price(columns, 0.0);
  std::vector<int> row_of(columns, kNone), column_of(rows, kNone);
  for (int start = 0; start < rows; ++start) {
    // Dijkstra over columns from row `start`; `via` is the row from which a column was reached.
    std::vector<double> distance(columns, std::numeric_limits<double>::infinity());
    std::vector<int> via(columns, kNone);
    std::vector<bool> done(columns, false);
    double reached = 0.0;
    int column = kNone;
    for (int row = start; row != kNone; row = row_of[column]) {
      int nearest = kNone;
      for (int j = 0; j < columns; ++j) {
        if (done[j]) continue;
        const double through = reached + costs(row, j) - row_price[row] - column_price[j];
        if (through < distance[j]) {
          distance[j] = through;
          via[j] = row;
        }
        if (nearest == kNone || distance[j] < distance[nearest]) nearest = j;
      }
      column = nearest;
      done[column] = true;
      reached = distance[column];
    }
    row_price[start] += reached;
    for (int j = 0; j < columns; ++j) {
      if (!done[j] || j == column) continue;
      column_price[j] -= reached - distance[j];
      row_price[row_of[j]] += reached - distance[j];
    }
    for (int free = column; free != kNone;) {  // switch the pairs along the path
      const int row = via[free];
      row_of[free] = row;
      std::swap(column_of[row], free);
    }
  }
  return column_of;
}

}  // namespace

std::vector<int> assign(const Eigen::MatrixXd& costs) {
  CV_Assert(costs.allFinite());
  if (costs.rows() <= costs.cols()) return assign_all_rows(costs);
  std::vector<int> column_of(static_cast<std::size_t>(costs.rows()), kNone);
  const std::vector<int> row_of = assign_all_rows(costs.transpose());
  for (std::size_t j = 0; j < row_of.size(); ++j)
    column_of[static_cast<std::size_t>(row_of[j])] = static_cast<int>(j);
  return column_of;
}

}  // namespace ipl_slam
