#include "evaluation/precision_recall.hpp"

#include <gtest/gtest.h>

#include "evaluation/precision_recall_plot.hpp"

namespace ipl_slam {
namespace {

const RetrievalOutcome kUnanswered{true, {}, false};

RetrievalOutcome right(double score) {
  return {true, score, true};
}
RetrievalOutcome wrong(double score) {
  return {true, score, false};
}
RetrievalOutcome wrong_where_nothing_is(double score) {
  return {false, score, false};
}

TEST(PrecisionRecall, every_score_is_a_threshold) {
  const std::vector<RetrievalOutcome> outcomes = {right(0.5), wrong(0.7), right(0.9), kUnanswered,
                                                  wrong_where_nothing_is(0.1)};
  const auto curve = precision_recall(outcomes);
  ASSERT_EQ(curve.size(), 4U);
  const double precision[] = {1.0, 1.0 / 2, 2.0 / 3, 2.0 / 4}, recall[] = {0.25, 0.25, 0.5, 0.5};
  const double threshold[] = {0.9, 0.7, 0.5, 0.1};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_DOUBLE_EQ(curve[i].threshold, threshold[i]);
    EXPECT_DOUBLE_EQ(curve[i].precision, precision[i]);
    EXPECT_DOUBLE_EQ(curve[i].recall, recall[i]);
  }
  EXPECT_DOUBLE_EQ(recall_at_full_precision(curve), 0.25);
  EXPECT_DOUBLE_EQ(average_precision(curve), 0.25 * 1.0 + 0.25 * 2.0 / 3);
}

TEST(PrecisionRecall, equal_scores_are_accepted_together) {
  const std::vector<RetrievalOutcome> outcomes = {right(0.5), wrong(0.5), right(0.5)};
  const auto curve = precision_recall(outcomes);
  ASSERT_EQ(curve.size(), 1U);
  EXPECT_DOUBLE_EQ(curve[0].precision, 2.0 / 3);
  EXPECT_DOUBLE_EQ(recall_at_full_precision(curve), 0.0);
}

TEST(PrecisionRecall, full_precision_ends_at_the_first_wrong_answer) {
  // Precision never comes back to 1 after it.
  const auto curve = precision_recall(std::vector{right(0.9), right(0.8), wrong(0.7), right(0.6)});
  EXPECT_DOUBLE_EQ(recall_at_full_precision(curve), 0.5);
}

TEST(PrecisionRecall, without_answers_or_anything_to_find_there_is_no_curve) {
  EXPECT_TRUE(precision_recall({}).empty());
  EXPECT_TRUE(precision_recall(std::vector{kUnanswered}).empty());
  EXPECT_TRUE(precision_recall(std::vector{wrong_where_nothing_is(0.3)}).empty());
  EXPECT_DOUBLE_EQ(recall_at_full_precision({}), 0.0);
  EXPECT_DOUBLE_EQ(average_precision({}), 0.0);
}

TEST(PrecisionRecallPlot, a_curve_leaves_ink_and_an_empty_one_is_no_error) {
  const auto curve = precision_recall(std::vector{right(0.9), wrong(0.7), right(0.6)});
  const cv::Mat with = draw_precision_recall({{"retrieval", curve}}, "test");
  const cv::Mat without = draw_precision_recall({{"retrieval", {}}}, "test");
  EXPECT_EQ(with.size(), cv::Size(800, 700));
  EXPECT_EQ(with.type(), CV_8UC3);
  EXPECT_GT(cv::norm(with, without, cv::NORM_INF), 100.0);
}

}  // namespace
}  // namespace ipl_slam
