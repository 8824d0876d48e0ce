#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/ids.hpp"
#include "common/options.hpp"
#include "features/features.hpp"

namespace ipl_slam {

struct PlaceIndexOptions {
  int max_candidates = 10;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_candidates", max_candidates, {1, 1000, "count", "keyframes a query returns at most"});
  }
};

/// A keyframe that may show what was asked for.
struct PlaceCandidate {
  KeyframeId keyframe;
  double score = 0.0;  ///< higher is more alike; comparable within one query
};

/// Finds the keyframes that look like a picture by its binary descriptors, without a vocabulary file: what it
/// knows of the world it learns from the descriptors it is given, one keyframe after the other. The same
/// calls give the same answers, to the bit.
class PlaceIndex {
 public:
  explicit PlaceIndex(const PlaceIndexOptions& options);

  /// `descriptors`: of the keyframe's static features. A keyframe must not be in the index yet.
  void add(KeyframeId id, std::span<const Descriptor> descriptors);
  /// Does nothing where the keyframe is not in the index.
  void remove(KeyframeId id);
  /// The most similar keyframes among those `eligible` allows, best first, then by id.
  [[nodiscard]] std::vector<PlaceCandidate> query(std::span<const Descriptor> descriptors,
                                                  const std::function<bool(KeyframeId)>& eligible) const;
  [[nodiscard]] std::size_t size() const;

 private:
  PlaceIndexOptions options_;
};

}  // namespace ipl_slam
