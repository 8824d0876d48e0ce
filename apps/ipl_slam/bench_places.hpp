#pragma once

#include <CLI/CLI.hpp>

namespace ipl_slam::cli {

/// Adds `bench places`: precision and recall of place recognition on sequences with ground truth.
///
/// Every frame is asked for among those before it that lie more than --gap seconds back, then becomes a
/// keyframe itself. Two frames show the same place (a positive pair) where of either's depth half or more
/// is seen by the other (evaluation/view_overlap.hpp), by the true poses; different places (a negative pair)
/// where neither share reaches a tenth. Anything between is no pair: such a candidate is neither right nor
/// wrong.
///
/// - The answer to a query is its best candidate that belongs to a pair; right where that is positive.
/// - precision = right answers / answers; recall = right answers / queries with at least one positive pair.
///   Both over answers of at least a score, for every score: the curve.
/// - recall@k = share of the queries with a positive pair that find one among their first k candidates,
///   those that are no pair counted among the k.
///
/// Queries with neither a positive nor a negative pair take no part. With --together all sequences share one
/// index, and a candidate from another sequence is a negative.
void add_bench_places(CLI::App& bench);

}  // namespace ipl_slam::cli
