#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace ipl_slam {

/// What came of asking once for a place seen before.
struct RetrievalOutcome {
  bool has_positive = false;  ///< whether there was something right to find
  /// The best answer, on which the threshold of acceptance is applied; nothing where none was given.
  std::optional<double> score;  ///< higher is surer; comparable between queries
  bool correct = false;         ///< whether that answer is right
};

/// One point of the curve: answers of at least this score are accepted.
struct PrecisionRecallPoint {
  double threshold = 0.0;
  double precision = 1.0;  ///< right answers / answers
  double recall = 0.0;     ///< right answers / queries that have something right to find
};

/// Precision and recall over all thresholds, by falling threshold: a point for every score that occurs.
/// Queries without anything to find count in precision only (whatever they are answered is wrong). Empty
/// where there is no answer or no query that has something to find.
[[nodiscard]] std::vector<PrecisionRecallPoint> precision_recall(std::span<const RetrievalOutcome> outcomes);

/// The highest recall at a precision of 1; 0 where the surest answer is wrong already.
[[nodiscard]] double recall_at_full_precision(std::span<const PrecisionRecallPoint> curve);

/// Area under the curve by the average of precision over recall: sum of (R_i - R_(i-1)) P_i.
[[nodiscard]] double average_precision(std::span<const PrecisionRecallPoint> curve);

}  // namespace ipl_slam
