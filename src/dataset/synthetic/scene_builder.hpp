#pragma once

#include <string>
#include <utility>

#include "common/random.hpp"
#include "dataset/synthetic/scene.hpp"

namespace ipl_slam::synthetic {

/// Puts a scene together: short calls for materials, solids, objects and motions that keep the indices right.
class SceneBuilder {
 public:
  explicit SceneBuilder(Scene& scene) : scene_(scene) {}

  /// A material of its own picture. Repeating ones are laid at texels_per_metre; 0 = the picture spans the
  /// face once.
  int material(const cv::Mat& picture, double texels_per_metre = 0.0) {
    scene_.textures.emplace_back(picture);
    Material material;
    material.texture = static_cast<int>(scene_.textures.size()) - 1;
    material.fit = texels_per_metre == 0.0;
    material.texels_per_metre = texels_per_metre;
    scene_.materials.push_back(material);
    return static_cast<int>(scene_.materials.size()) - 1;
  }

  /// The same picture laid from another starting point.
  int shifted(int material, double du, double dv) {
    Material copy = scene_.materials[material];
    copy.offset = {du, dv};
    scene_.materials.push_back(copy);
    return static_cast<int>(scene_.materials.size()) - 1;
  }

  /// Starts a named object; what is added until the next call belongs to it. Returns its id.
  int object(const std::string& class_name) {
    SceneObject object;
    object.id = static_cast<int>(scene_.objects.size()) + 1;
    object.class_name = class_name;
    scene_.objects.push_back(object);
    current_object_ = object.id;
    return object.id;
  }
  /// What is added from here on is structure without a name.
  void structure() { current_object_ = 0; }

  /// Hands the current object's motion over; what is added next hangs on the motion's first frame. Returns
  /// that frame.
  int motion(std::unique_ptr<Motion> motion) {
    SceneObject& object = scene_.objects[current_object_ - 1];
    object.moving = true;
    object.first_frame = frame_count_;
    object.frame_count = motion->frame_count();
    frame_count_ += motion->frame_count();
    scene_.motions.push_back(std::move(motion));
    return object.first_frame;
  }

  /// Frame in which positions are given from here on: a moving one, or T_wf of furniture that stands still.
  void on_frame(int frame) {
    frame_ = frame;
    T_fb_ = SE3();
  }
  void at(const Eigen::Vector3d& position, double yaw = 0.0) {
    frame_ = 0;
    T_fb_ = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), position);
  }

  /// A box of full side lengths `size` about `centre`, turned by yaw; returns it for changes of single faces.
  Primitive& box(const Eigen::Vector3d& centre, const Eigen::Vector3d& size, int material, double yaw = 0.0) {
    Primitive& p = add(Shape::Box, centre, 0.5 * size, material);
    p.T_fp = T_fb_ * SE3(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), centre);
    return p;
  }

  /// A capsule between two points with radii rx and ry (ry along the frame's y-axis for upright capsules).
  Primitive& capsule(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double rx, double ry,
                     int material) {
    Primitive& p = add(Shape::Capsule, 0.5 * (from + to), {rx, ry, 0.5 * (to - from).norm()}, material);
    const Eigen::Vector3d axis = to - from;
    const auto turn = axis.norm() > 0.0 ? Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis)
                                        : Eigen::Quaterniond::Identity();
    p.T_fp = T_fb_ * SE3(turn, 0.5 * (from + to));
    return p;
  }

 private:
  Primitive& add(Shape shape, const Eigen::Vector3d& centre, const Eigen::Vector3d& size, int material) {
    Primitive p;
    p.shape = shape;
    p.size = size;
    p.materials.fill(material);
    p.frame = frame_;
    p.object = current_object_;
    p.T_fp = T_fb_ * SE3(Eigen::Quaterniond::Identity(), centre);
    scene_.primitives.push_back(p);
    return scene_.primitives.back();
  }

  Scene& scene_;
  int current_object_ = 0;
  int frame_ = 0;
  int frame_count_ = 1;
  SE3 T_fb_;
};

}  // namespace ipl_slam::synthetic
