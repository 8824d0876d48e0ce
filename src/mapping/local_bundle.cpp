#include "mapping/local_bundle.hpp"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "mapping/map_bundle.hpp"
#include "mapping/seen_landmarks.hpp"

namespace ipl_slam {

std::set<KeyframeId> keyframes_around(const Map& map, KeyframeId centre, int limit, int min_shared) {
  std::set<KeyframeId> chosen{centre};
  for (const Covisible& neighbour : map.covisible(centre)) {
    if (neighbour.shared < min_shared || static_cast<int>(chosen.size()) >= limit) break;
    chosen.insert(neighbour.keyframe);
  }
  return chosen;
}

std::set<KeyframeId> holding_keyframes(const Map& map, const std::set<KeyframeId>& free, int limit,
                                       const std::set<KeyframeId>* among) {
  std::map<KeyframeId, int> shared;
  const auto count = [&](const std::vector<Observation>& observations) {
    for (const Observation& o : observations) {
      if (!free.contains(o.keyframe) && (!among || among->contains(o.keyframe))) ++shared[o.keyframe];
    }
  };
  for (const PointId id : seen_landmarks(map, free, &Keyframe::points)) count(map.points()[id].observations);
  for (const LineId id : seen_landmarks(map, free, &Keyframe::lines)) count(map.lines()[id].observations);
  std::vector<std::pair<int, KeyframeId>> order;
  for (const auto& [id, times] : shared) order.emplace_back(-times, id);
  std::sort(order.begin(), order.end());
  std::set<KeyframeId> chosen;
  for (const auto& [times, id] : order) {
    if (static_cast<int>(chosen.size()) >= limit) break;
    chosen.insert(id);
  }
  return chosen;
}

void adjust_local_bundle(Map& map, KeyframeId centre, const Camera& camera, const DepthNoiseOptions& noise,
                         const LocalBundleOptions& options, const std::atomic<bool>* abort) {
  const std::set<KeyframeId> free = keyframes_around(map, centre, options.max_keyframes, options.min_shared);
  const std::set<KeyframeId> fixed = holding_keyframes(map, free, options.max_fixed_keyframes);
  MapBundle bundle(map, free, fixed, options.line_noise());
  const BundleResult result = adjust_bundle(bundle.problem, camera, noise, options.solver, abort);
  bundle.write_back(map, result, camera, noise);
}

}  // namespace ipl_slam
