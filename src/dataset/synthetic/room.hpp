#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "dataset/synthetic/person.hpp"
#include "dataset/synthetic/scene.hpp"

namespace ipl_slam::synthetic {

/// What moves in a room.
struct RoomContents {
  std::uint64_t seed = 1;
  std::string story = "walk";  ///< see SyntheticOptions::story
  Clothes clothes = Clothes::Plain;
  int people = 0;
  int boxes = 0;  ///< the first is pushed about on the table, the second is the door, others follow suit
  double duration = 1.0;                                        ///< seconds for which motions are worked out
  std::function<Eigen::Vector3d(double time)> camera_position;  ///< people keep out of its way
};

/// Extent of the room: x and y from -half to +half, z from 0.
inline const Eigen::Vector3d kRoomHalfExtent{3.5, 3.0, 1.35};

/// Where the camera can go in it.
[[nodiscard]] CameraSite room_camera_site();

/// A furnished office room of 7 x 6 x 2.7 m with a table and two chairs in the middle, desks, shelves and
/// cabinets along the walls, posters, and a door through which people come and go.
[[nodiscard]] Scene make_room(const RoomContents& contents);

}  // namespace ipl_slam::synthetic
