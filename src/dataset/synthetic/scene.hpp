#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "dataset/synthetic/loop_path.hpp"
#include "dataset/synthetic/texture.hpp"
#include "geometry/se3.hpp"

/// What there is to see, told apart from how it is drawn (renderer.hpp) and from where it is seen
/// (camera_path.hpp). A scene is a list of simple solids with materials; each solid hangs on a coordinate
/// frame, and frames can move. World frame: metres, z up, the floor at z = 0.
namespace ipl_slam::synthetic {

enum class Shape {
  Box,     ///< half extents `size`
  Capsule  ///< a tube along local z with round ends: radii size.x and size.y, half length of the straight
           ///< part size.z
};

/// How a surface is painted.
struct Material {
  int texture = 0;
  bool fit = false;                  ///< the picture spans the face once; otherwise it repeats
  double texels_per_metre = 256.0;   ///< of repeating pictures
  Eigen::Vector2d offset{0.0, 0.0};  ///< of repeating pictures, metres: two walls need not look alike
};

/// A solid. Coordinates: T_fp places it in its frame.
struct Primitive {
  Shape shape = Shape::Box;
  Eigen::Vector3d size{0.5, 0.5, 0.5};
  std::array<int, 6> materials{};  ///< faces -x +x -y +y -z +z of a box; a capsule uses the first
  int frame = 0;                   ///< index into Scene::frames(t); 0 is the world
  int object = 0;                  ///< SceneObject::id, 0 for walls and other structure without a name
  SE3 T_fp;
};

/// Something with a name. Ids are 1, 2, ... in the order of the list.
struct SceneObject {
  int id = 0;
  std::string class_name;  ///< the name COCO has for it where there is one
  bool moving = false;     ///< whether it can move during the sequence
  int first_frame = 0;     ///< of its own coordinate frames, if it moves
  int frame_count = 0;
};

/// Moves a run of coordinate frames.
class Motion {
 public:
  virtual ~Motion() = default;
  [[nodiscard]] virtual int frame_count() const = 0;
  /// Appends T_wf of each of its frames at `time` (seconds from the start).
  virtual void append_frames(double time, std::vector<SE3>& frames) const = 0;
};

/// Where someone can go to and fro across a loop.
struct Crossing {
  double time = 0.0;   ///< at which the camera comes there in the first round, seconds
  double reach = 1.0;  ///< free floor to either side, metres
};

/// Places from which the camera can look around without touching anything.
struct CameraSite {
  Eigen::Vector3d look_at{0, 0, 0.8};     ///< the middle of what is interesting
  Eigen::Vector2d orbit_radii{1.0, 1.0};  ///< of the free ellipse about look_at
  double eye_height = 1.4;
  Eigen::Vector3d station{-1, -1, 1.4};     ///< a good place to stay, 0.4 m free all around
  Eigen::Vector3d sweep_from{-1, -1, 1.4};  ///< ends of a free straight path beside the scene
  Eigen::Vector3d sweep_to{1, -1, 1.4};
  Eigen::Vector3d free_min{-1, -1, 0.5};  ///< the box no camera path leaves
  Eigen::Vector3d free_max{1, 1, 2};
  LoopPath loop;                    ///< a round through a whole building, where there is one
  std::vector<Crossing> crossings;  ///< of the loop
};

struct Scene {
  std::vector<Texture> textures;
  std::vector<Material> materials;
  std::vector<Primitive> primitives;
  std::vector<SceneObject> objects;
  std::vector<std::unique_ptr<Motion>> motions;
  Eigen::Vector3d lamp{0.0, 0.0, 2.5};
  double softness = 0.0;  ///< of the lens it is seen through: sigma of its blur, pixels in a width of 640
  CameraSite site;

  /// T_wf of every coordinate frame at a time: the world's first, then those of the motions in their order.
  [[nodiscard]] std::vector<SE3> frames(double time) const {
    std::vector<SE3> result(1);
    for (const auto& motion : motions) motion->append_frames(time, result);
    return result;
  }
};

}  // namespace ipl_slam::synthetic
