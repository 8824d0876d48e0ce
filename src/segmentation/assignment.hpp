#pragma once

#include <vector>

#include <Eigen/Core>

namespace ipl_slam {

/// The column that each row gets so that the sum of costs is least; -1 for a row that gets none, which
/// happens only where there are more rows than columns. The same matrix always gives the same answer. Costs
/// must be finite. O(n^3) by shortest augmenting paths (Kuhn, "The Hungarian method for the assignment
/// problem", 1955; Jonker and Volgenant, Computing 1987).
[[nodiscard]] std::vector<int> assign(const Eigen::MatrixXd& costs);

}  // namespace ipl_slam
