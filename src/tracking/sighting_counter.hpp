#pragma once

#include <utility>
#include <vector>

#include "tracking/tracked_frame.hpp"

namespace ipl_slam {

/// Counts how often landmarks should have been and were seen, under their index in the present local map.
template <class LandmarkId>
class SightingCounter {
 public:
  /// A new local map; what was counted is kept. `landmarks` are its LocalMap::points or lines.
  template <class LocalLandmarks>
  void start(const LocalLandmarks& landmarks) {
    keep();
    counting_.clear();
    for (const auto& landmark : landmarks) counting_.push_back({landmark.id, 0, 0});
  }
  void visible(int index) { ++counting_[static_cast<std::size_t>(index)].visible; }
  void found(int index) { ++counting_[static_cast<std::size_t>(index)].found; }

  /// Hands over what was counted since the last call.
  [[nodiscard]] std::vector<Sighting<LandmarkId>> take() {
    keep();
    return std::exchange(kept_, {});
  }

 private:
  void keep() {
    for (Sighting<LandmarkId>& s : counting_) {
      if (s.visible > 0) kept_.push_back(s);
      s.visible = s.found = 0;
    }
  }

  std::vector<Sighting<LandmarkId>> counting_;  // per landmark of the local map
  std::vector<Sighting<LandmarkId>> kept_;      // of local maps before it
};

}  // namespace ipl_slam
