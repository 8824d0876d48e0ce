#include "pipeline/map_keeper.hpp"

namespace ipl_slam {

std::shared_ptr<const LocalMap> MapKeeper::add(const KeyframeCandidate& candidate,
                                               const std::atomic<bool>* abort) {
  const KeyframeId id = mapper_.process(map_, candidate, abort);
  return std::make_shared<const LocalMap>(build_local_map(map_, id, local_map_));
}

}  // namespace ipl_slam
