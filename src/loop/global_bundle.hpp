#pragma once

#include <atomic>

#include "map/map.hpp"
#include "mapping/bundle_adjustment.hpp"
#include "mapping/map_bundle.hpp"

namespace ipl_slam {

/// Bundle adjustment of a whole part of the map, on a copy: it can be solved on a thread of its own while the
/// map goes on changing.
///
///   GlobalBundle bundle(map, part, ...);   // on the mapper's thread
///   bundle.solve(&abort);                  // anywhere
///   bundle.apply(map);                     // on the mapper's thread
class GlobalBundle {
 public:
  GlobalBundle(const Map& map, PartId part, const Camera& camera, const DepthNoiseOptions& noise,
               const LineNoise& line_noise, const BundleOptions& options);

  /// Returns false when it was aborted: then there is nothing to apply. Touches no map.
  bool solve(const std::atomic<bool>* abort = nullptr);
  /// Brings the result into the map. Keyframes that came after the copy was made keep their place relative to
  /// the keyframe they share most landmarks with, or else to the one before; landmarks that came after it, or
  /// are seen only once, move along with the oldest keyframe that sees them. What is gone is left out. Does
  /// nothing and returns false where there is nothing to apply, the part was merged into another or a loop
  /// was closed meanwhile: its result is no longer that of the map.
  bool apply(Map& map) const;

 private:
  PartId part_;
  Camera camera_;
  DepthNoiseOptions noise_;
  BundleOptions options_;
  std::size_t loops_;
  MapBundle bundle_;
  BundleResult result_;
  bool solved_ = false;
};

}  // namespace ipl_slam
