#include "dataset/synthetic/furniture.hpp"

#include <numbers>

#include "dataset/synthetic/paint.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

}  // namespace

Furniture::Furniture(Scene& scene, std::uint64_t seed) : scene_(scene), builder_(scene), random_(seed) {
  wood_ = builder_.material(paint_wood(512, {75, 115, 160}, random_), 400.0);
  pale_wood_ = builder_.material(paint_wood(512, {140, 175, 200}, random_), 400.0);
  metal_ = builder_.material(paint_plain(256, {120, 115, 110}, 14.0F, random_), 300.0);
  dark_ = builder_.material(paint_plain(256, {38, 36, 35}, 12.0F, random_), 300.0);
  for (int i = 0; i < 8; ++i) cardboard_.push_back(builder_.material(paint_cardboard(256, random_)));
}

void Furniture::add_table(const Vector3d& at, double yaw, const Vector2d& size, int top) {
  builder_.object("dining table");
  builder_.at(at, yaw);
  builder_.box({0, 0, kTableTop - 0.02}, {size.x(), size.y(), 0.04}, top);
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      builder_.box({x * (0.5 * size.x() - 0.05), y * (0.5 * size.y() - 0.05), 0.5 * (kTableTop - 0.04)},
                   {0.05, 0.05, kTableTop - 0.04}, metal_);
    }
  }
}

void Furniture::add_chair(const Vector3d& at, double yaw) {  // the sitter looks along +x
  builder_.object("chair");
  builder_.at(at, yaw);
  const double red = random_.uniform(60, 170);
  const int seat = builder_.material(paint_plain(256, {70, 60, red}, 18.0F, random_), 300.0);
  builder_.box({0, 0, 0.40}, {0.42, 0.42, 0.05}, seat);
  builder_.box({-0.20, 0, 0.72}, {0.04, 0.40, 0.34}, seat);
  for (const double x : {-0.18, 0.18}) {
    for (const double y : {-0.18, 0.18}) builder_.box({x, y, 0.19}, {0.035, 0.035, 0.38}, metal_);
  }
  for (const double y : {-0.17, 0.17}) builder_.box({-0.20, y, 0.49}, {0.03, 0.03, 0.16}, metal_);
}

void Furniture::add_monitor(const Vector3d& at, double yaw) {  // the screen looks along +x
  builder_.object("tv");
  builder_.at(at, yaw);
  const int screen = builder_.material(paint_screen(512, 256, random_));
  builder_.box({0, 0, 0.30}, {0.05, 0.60, 0.36}, dark_).materials[1] = screen;
  builder_.box({-0.03, 0, 0.08}, {0.04, 0.06, 0.14}, dark_);
  builder_.box({-0.02, 0, 0.01}, {0.18, 0.26, 0.02}, dark_);
}

void Furniture::add_keyboard(const Vector3d& at, double yaw) {
  builder_.object("keyboard");
  builder_.at(at, yaw);
  const int keys = builder_.material(paint_mosaic(256, 16, random_));
  builder_.box({0, 0, 0.012}, {0.16, 0.44, 0.024}, dark_).materials[5] = keys;
}

void Furniture::add_book(const Vector3d& at, double yaw) {
  builder_.object("book");
  builder_.at(at, yaw);
  const int cover = builder_.material(paint_poster(256, 256, random_));
  builder_.box({0, 0, 0.015}, {0.17, 0.24, 0.03}, pale_wood_).materials[5] = cover;
}

void Furniture::add_cup(const Vector3d& at) {
  builder_.object("cup");
  builder_.at(at);
  const int glaze = builder_.material(paint_mosaic(64, 4, random_), 600.0);
  builder_.capsule({0, 0, 0.03}, {0, 0, 0.08}, 0.036, 0.036, glaze);
}

void Furniture::add_carton(const Vector3d& at, double yaw, const Vector3d& size) {
  builder_.object("box");
  builder_.at(at, yaw);
  carton(size);
}

void Furniture::carton(const Vector3d& size) {
  builder_.box({0, 0, 0.5 * size.z()}, size, cardboard_[random_.index(cardboard_.size())]);
  Primitive& p = scene_.primitives.back();
  for (int& face : p.materials) face = cardboard_[random_.index(cardboard_.size())];
}

void Furniture::add_cabinet(const Vector3d& at, double yaw, const Vector3d& size,
                            int rows) {  // the front looks along +x
  builder_.structure();
  builder_.at(at, yaw);
  const int front = builder_.material(paint_drawers(256, 512, rows, random_));
  builder_.box({0, 0, 0.5 * size.z()}, size, builder_.shifted(metal_, random_.uniform(), 0)).materials[1] =
      front;
}

void Furniture::add_bookshelf(const Vector3d& at, double yaw, double width, double height, int shelves) {
  builder_.structure();
  builder_.at(at, yaw);
  const int books = builder_.material(paint_books(512, 1024, shelves, random_));
  builder_.box({0, 0, 0.5 * height}, {0.32, width, height}, wood_).materials[1] = books;
}

void Furniture::add_open_shelf(const Vector3d& at, double yaw) {
  builder_.structure();
  builder_.at(at, yaw);
  for (const double y : {-0.58, 0.58}) builder_.box({0, y, 0.7}, {0.32, 0.03, 1.4}, pale_wood_);
  for (int level = 0; level < 4; ++level) {
    const double z = 0.12 + 0.42 * level;
    builder_.box({0, 0, z}, {0.32, 1.16, 0.03}, pale_wood_);
    for (double y = -0.42; level < 3 && y < 0.5; y += 0.28) {
      if (!random_.chance(0.8)) continue;
      builder_.at(at, yaw);
      const Vector3d size(random_.uniform(0.16, 0.26), random_.uniform(0.12, 0.22),
                          random_.uniform(0.14, 0.32));
      builder_.box({0, y, z + 0.015 + 0.5 * size.z()}, size, cardboard_[random_.index(cardboard_.size())],
                   random_.uniform(-0.3, 0.3));
    }
  }
}

void Furniture::add_desk_along_wall(const Vector3d& at, double yaw) {  // its user would look along -x
  add_table(at, yaw + pi / 2, {1.5, 0.55}, pale_wood_);
  const SE3 T_wd(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ())), at);
  const auto on = [&](double x, double y) { return T_wd * Vector3d(x, y, kTableTop); };
  add_monitor(on(-0.12, random_.uniform(-0.3, 0.1)), yaw + random_.uniform(-0.2, 0.2));
  add_keyboard(on(0.15, -0.1), yaw + random_.uniform(-0.1, 0.1));
  add_book(on(0.10, 0.52), yaw + random_.uniform(-0.6, 0.6));
  add_cup(on(0.10, -0.52));
  builder_.structure();
  builder_.at(on(-0.1, 0.60), yaw);
  builder_.box({0, 0, 0.12}, {0.2, 0.16, 0.24}, cardboard_[random_.index(cardboard_.size())], 0.3);
}

}  // namespace ipl_slam::synthetic
