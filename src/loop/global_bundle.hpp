#pragma once

#include <atomic>
#include <memory>

#include "map/map.hpp"
#include "mapping/bundle_adjustment.hpp"
#include "mapping/local_bundle.hpp"

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
               const LocalBundleOptions& options);
  ~GlobalBundle();
  GlobalBundle(GlobalBundle&&) noexcept;
  GlobalBundle& operator=(GlobalBundle&&) noexcept;

  /// Returns false when it was aborted: then there is nothing to apply.
  bool solve(const std::atomic<bool>* abort = nullptr);
  /// Keyframes and landmarks that came after the copy was made move along with the keyframe they share most
  /// with. Does nothing where the part was merged into another meanwhile.
  void apply(Map& map) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ipl_slam
