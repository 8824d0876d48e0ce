#include "evaluation/precision_recall.hpp"

#include <algorithm>

namespace ipl_slam {

std::vector<PrecisionRecallPoint> precision_recall(std::span<const RetrievalOutcome> outcomes) {
  const auto findable = std::count_if(outcomes.begin(), outcomes.end(),
                                      [](const RetrievalOutcome& o) { return o.has_positive; });
  if (findable == 0) return {};
  std::vector<RetrievalOutcome> answers;
  std::copy_if(outcomes.begin(), outcomes.end(), std::back_inserter(answers),
               [](const RetrievalOutcome& o) { return o.score.has_value(); });
  std::sort(answers.begin(), answers.end(),
            [](const RetrievalOutcome& a, const RetrievalOutcome& b) { return *a.score > *b.score; });

  std::vector<PrecisionRecallPoint> curve;
  std::size_t correct = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    correct += answers[i].correct ? 1 : 0;
    // Equal scores are accepted together or not at all.
    if (i + 1 < answers.size() && *answers[i + 1].score == *answers[i].score) continue;
    curve.push_back({*answers[i].score, static_cast<double>(correct) / static_cast<double>(i + 1),
                     static_cast<double>(correct) / static_cast<double>(findable)});
  }
  return curve;
}

double recall_at_full_precision(std::span<const PrecisionRecallPoint> curve) {
  double best = 0.0;
  for (const PrecisionRecallPoint& point : curve) {
    if (point.precision < 1.0) break;
    best = point.recall;
  }
  return best;
}

double average_precision(std::span<const PrecisionRecallPoint> curve) {
  double sum = 0.0, recall = 0.0;
  for (const PrecisionRecallPoint& point : curve) {
    sum += (point.recall - recall) * point.precision;
    recall = point.recall;
  }
  return sum;
}

}  // namespace ipl_slam
