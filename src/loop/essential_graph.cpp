#include "loop/essential_graph.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "loop/part_keyframes.hpp"

namespace ipl_slam {
namespace {

using Pair = std::pair<KeyframeId, KeyframeId>;  // in order of id

struct CovisiblePair {
  Pair ids;
  int shared = 0;
};

// All that share a landmark, most shared first, then by id; at the end successive keyframes that share none.
std::vector<CovisiblePair> covisible_pairs(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<CovisiblePair> pairs;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const KeyframeId a = keyframes[i];
    bool follower_shares = i + 1 == keyframes.size();
    for (const Covisible& other : map.covisible(a)) {
      if (other.keyframe < a) continue;
      pairs.push_back({{a, other.keyframe}, other.shared});
      follower_shares = follower_shares || other.keyframe == keyframes[i + 1];
    }
    if (!follower_shares) pairs.push_back({{a, keyframes[i + 1]}, 0});
  }
  std::sort(pairs.begin(), pairs.end(), [](const CovisiblePair& p, const CovisiblePair& q) {
    return std::tuple(-p.shared, p.ids) < std::tuple(-q.shared, q.ids);
  });
  return pairs;
}

// Disjoint sets of keyframes, for Kruskal's algorithm.
class Pieces {
 public:
  explicit Pieces(std::size_t ids) : parent_(ids) { std::iota(parent_.begin(), parent_.end(), 0U); }
  // False where the two are connected already.
  bool connect(const Pair& ids) {
    const std::uint32_t a = root(ids.first.value), b = root(ids.second.value);
    parent_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }

 private:
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  std::vector<std::uint32_t> parent_;
};

}  // namespace

std::vector<EssentialEdge> essential_graph(const Map& map, PartId part,
                                           const EssentialGraphOptions& options) {
  const std::set<KeyframeId> members = part_keyframes(map, part);
  const std::vector<KeyframeId> keyframes(members.begin(), members.end());
  std::set<Pair> successive, loops;
  for (std::size_t i = 0; i + 1 < keyframes.size(); ++i) successive.emplace(keyframes[i], keyframes[i + 1]);
  for (const LoopEdge& loop : map.loops())
    if (map.keyframes()[loop.a].part == part) loops.insert(std::minmax(loop.a, loop.b));

  std::map<Pair, int> kept;
  Pieces pieces(map.keyframes().ids_used());
  for (const auto& [ids, shared] : covisible_pairs(map, keyframes)) {
    const bool in_tree = pieces.connect(ids);
    if (in_tree || shared >= options.strong_shared || (shared > 0 && successive.contains(ids)) ||
        loops.contains(ids))
      kept.emplace(ids, shared);
  }
  for (const Pair& ids : loops) kept.emplace(ids, 0);  // those that share nothing

  std::vector<EssentialEdge> edges;
  for (const auto& [ids, shared] : kept) {
    const SE3 &T_aw = map.keyframes()[ids.first].T_cw, &T_bw = map.keyframes()[ids.second].T_cw;
    edges.push_back({ids.first, ids.second, shared, T_aw * T_bw.inverse()});
  }
  return edges;
}

}  // namespace ipl_slam
