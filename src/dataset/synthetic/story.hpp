#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/random.hpp"
#include "dataset/synthetic/person.hpp"

/// What happens before the camera's station, where no chance decides. The stage is the floor there: x ahead
/// of the camera, y to its left, metres from the station.
namespace ipl_slam::synthetic {

/// So many people have a place on the stage.
constexpr int kStagePlaces = 4;

/// Where the stage lies and how long the story lasts.
struct Stage {
  explicit Stage(const CameraSite& site);

  [[nodiscard]] Eigen::Vector2d at(double ahead, double left) const;

  Eigen::Vector2d station;
  double heading;  ///< of the camera, radians
};

/// Whether the people of a story have parts on the stage; in the others each does as chance decides.
[[nodiscard]] bool has_roles(const std::string& story);

/// The part of one of `people` in a story of people, see SyntheticOptions::story:
///   stand  everybody stands at a place, in view, for ever
///   crowd  everybody walks round and round close before the camera
///   enter  everybody comes from outside the view, one after the other, from a quarter of the duration (s)
///   on,
///          walks to a place and stands there
///   leave  the same the other way round
[[nodiscard]] Role make_role(const std::string& story, const Stage& stage, int person, int people,
                             double duration, Random& random);

/// How the big box of the story "push" moves: still for the first third of the duration (s), from then on
/// smoothly to and fro across the view.
[[nodiscard]] std::unique_ptr<Motion> make_late_push(const Stage& stage, double duration);

}  // namespace ipl_slam::synthetic
