#pragma once

#include <cstdint>

#include "dataset/synthetic/person.hpp"
#include "dataset/synthetic/scene_builder.hpp"

namespace ipl_slam::synthetic {

/// People met on a round through a building.
struct PassersBy {
  std::uint64_t seed = 1;
  Clothes clothes = Clothes::Plain;
  int people = 0;
  double duration = 1.0;  ///< seconds for which motions are worked out
};

/// Where someone goes to and fro across a loop, at `time` (seconds) in the camera's round.
[[nodiscard]] Eigen::Vector2d crossing_place(const LoopPath& loop, const Crossing& crossing, double time);

/// Adds people to a scene whose site has a loop: the first walks it ahead of the camera, the others to and
/// fro across it, one at a crossing, spread over all there are. They are timed so that they cross before the
/// camera and are out of its way when it comes, in every round. At most one more than there are crossings.
void add_passers_by(SceneBuilder& builder, const CameraSite& site, const PassersBy& contents);

}  // namespace ipl_slam::synthetic
