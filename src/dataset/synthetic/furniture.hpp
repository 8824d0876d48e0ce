#pragma once

#include <cstdint>
#include <vector>

#include "common/random.hpp"
#include "dataset/synthetic/scene_builder.hpp"

namespace ipl_slam::synthetic {

constexpr double kTableTop = 0.74;  ///< height of tables and desks, metres

/// Furniture and small things, each with pictures of its own. A piece stands at a place on the floor (small
/// things: at any height) with its x-axis, which points out of its front, turned by yaw.
class Furniture {
 public:
  Furniture(Scene& scene, std::uint64_t seed);

  /// Sides `size`; four legs.
  void add_table(const Eigen::Vector3d& at, double yaw, const Eigen::Vector2d& size, int top);
  /// Its sitter looks along +x.
  void add_chair(const Eigen::Vector3d& at, double yaw);
  /// The screen looks along +x.
  void add_monitor(const Eigen::Vector3d& at, double yaw);
  void add_keyboard(const Eigen::Vector3d& at, double yaw);
  void add_book(const Eigen::Vector3d& at, double yaw);
  void add_cup(const Eigen::Vector3d& at);
  void add_carton(const Eigen::Vector3d& at, double yaw, const Eigen::Vector3d& size);
  /// The same as a part of the object, and in the coordinates, the builder is at.
  void carton(const Eigen::Vector3d& size);
  /// Rows of drawers on its front.
  void add_cabinet(const Eigen::Vector3d& at, double yaw, const Eigen::Vector3d& size, int rows);
  /// 0.32 m deep.
  void add_bookshelf(const Eigen::Vector3d& at, double yaw, double width, double height, int shelves);
  /// 0.32 x 1.16 x 1.4 m, with cartons on it.
  void add_open_shelf(const Eigen::Vector3d& at, double yaw);
  /// 0.55 x 1.5 m, with a screen and small things; its user would look along -x.
  void add_desk_along_wall(const Eigen::Vector3d& at, double yaw);

  [[nodiscard]] int wood() const { return wood_; }
  [[nodiscard]] int pale_wood() const { return pale_wood_; }
  [[nodiscard]] int metal() const { return metal_; }
  [[nodiscard]] int dark() const { return dark_; }
  [[nodiscard]] SceneBuilder& builder() { return builder_; }
  [[nodiscard]] Random& random() { return random_; }

 private:
  Scene& scene_;
  SceneBuilder builder_;
  Random random_;
  int wood_, pale_wood_, metal_, dark_;
  std::vector<int> cardboard_;
};

}  // namespace ipl_slam::synthetic
