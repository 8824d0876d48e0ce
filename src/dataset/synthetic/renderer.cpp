#include "dataset/synthetic/renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "dataset/synthetic/parallel_loop.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNear = 0.02;  // metres; nothing closer is drawn
constexpr int kTile = 16;       // pixels; primitives are sorted into square tiles of this side
constexpr float kAmbient = 0.5F;
constexpr float kDiffuse = 0.55F;
constexpr float kNothing = 30.0F;  // grey value where no surface is hit
// Softens texture slightly more than the sampling theorem's minimum, as lens and demosaicing of a real camera
// do.
constexpr double kPixelBlur = 1.15;
// A footprint that a slanted surface stretches is covered by up to kMaxAnisotropy texture samples, each up to
// kStretch times as long as it is wide.
constexpr int kMaxAnisotropy = 6;
constexpr double kStretch = 1.5;

// Sub-pixel offsets of the rays on outlines: eight rooks, every row and column of an 8 x 8 grid used once.
constexpr double kOutlineSamples[8][2] = {{-7 / 16., -1 / 16.}, {-5 / 16., 5 / 16.}, {-3 / 16., -5 / 16.},
                                          {-1 / 16., 1 / 16.},  {1 / 16., 7 / 16.},  {3 / 16., -7 / 16.},
                                          {5 / 16., -3 / 16.},  {7 / 16., 3 / 16.}};

// A primitive seen from the camera: everything that is the same for all its rays is computed once per image.
struct PosedPrimitive {
  const Primitive* primitive;
  Matrix3d to_local;  // camera direction -> local direction, in units in which a capsule has radius 1
  Vector3d origin;    // the camera's centre in the same coordinates
  Matrix3d R_cp;
  Vector3d scale;      // local units, metres
  double half_length;  // of a capsule, local units
  Vector3d centre_c;
  Matrix3d extent_c;  // columns: half edges of the bounding box, in the camera frame
  double z_min;
};

struct Hit {
  double z = std::numeric_limits<double>::infinity();
  int primitive = -1;  // index into the posed list
  int face = 0;
};

struct View {
  const Scene& scene;
  const Camera& camera;
  Vector3d lamp_c;
  std::vector<PosedPrimitive> posed;
  int tile_columns, tile_rows;
  std::vector<std::vector<int>> tiles;  // posed primitives per tile, nearest first
};

PosedPrimitive pose(const Primitive& primitive, const SE3& T_cp) {
  PosedPrimitive p;
  p.primitive = &primitive;
  p.R_cp = T_cp.rotation_matrix();
  p.centre_c = T_cp.translation();
  Vector3d extent = primitive.size;
  if (primitive.shape == Shape::Capsule) {
    p.scale = {primitive.size.x(), primitive.size.y(), primitive.size.x()};
    p.half_length = primitive.size.z() / primitive.size.x();
    extent.z() += primitive.size.x();
  } else {
    p.scale = Vector3d::Ones();
    p.half_length = 0.0;
  }
  p.to_local = p.scale.cwiseInverse().asDiagonal() * p.R_cp.transpose();
  p.origin = -(p.to_local * p.centre_c);
  p.extent_c = p.R_cp * extent.asDiagonal();
  p.z_min = p.centre_c.z() - p.extent_c.row(2).cwiseAbs().sum();
  return p;
}

// Whether the primitive's bounding box reaches the positive side of a plane through the camera's centre.
bool reaches(const PosedPrimitive& p, const Vector3d& normal) {
  return normal.dot(p.centre_c) + (normal.transpose() * p.extent_c).cwiseAbs().sum() >= 0.0;
}

// Sorts the primitives into tiles: one is in a tile if it reaches into all four side planes of the tile's
// pyramid.
void fill_tiles(View& view) {
  const Camera& camera = view.camera;
  view.tile_columns = (camera.width + kTile - 1) / kTile;
  view.tile_rows = (camera.height + kTile - 1) / kTile;
  view.tiles.assign(static_cast<std::size_t>(view.tile_columns) * view.tile_rows, {});
  std::vector<char> column(view.tile_columns), row(view.tile_rows);
  for (int k = 0; k < static_cast<int>(view.posed.size()); ++k) {
    const PosedPrimitive& p = view.posed[k];
    for (int i = 0; i < view.tile_columns; ++i) {
      const double left = (i * kTile - 1.0 - camera.cx) / camera.fx;
      const double right = ((i + 1) * kTile - camera.cx) / camera.fx;
      column[i] = reaches(p, {1, 0, -left}) && reaches(p, {-1, 0, right});
    }
    for (int i = 0; i < view.tile_rows; ++i) {
      const double top = (i * kTile - 1.0 - camera.cy) / camera.fy;
      const double bottom = ((i + 1) * kTile - camera.cy) / camera.fy;
      row[i] = reaches(p, {0, 1, -top}) && reaches(p, {0, -1, bottom});
    }
    for (int j = 0; j < view.tile_rows; ++j) {
      if (!row[j]) continue;
      for (int i = 0; i < view.tile_columns; ++i) {
        if (column[i]) view.tiles[static_cast<std::size_t>(j) * view.tile_columns + i].push_back(k);
      }
    }
  }
}

View make_view(const Scene& scene, const Camera& camera, const SE3& T_wc, double time) {
  View view{scene, camera, {}, {}, 0, 0, {}};
  const SE3 T_cw = T_wc.inverse();
  view.lamp_c = T_cw * scene.lamp;
  const std::vector<SE3> T_wf = scene.frames(time);
  for (const Primitive& primitive : scene.primitives) {
    PosedPrimitive p = pose(primitive, T_cw * T_wf[primitive.frame] * primitive.T_fp);
    if (p.centre_c.z() + p.extent_c.row(2).cwiseAbs().sum() > kNear) view.posed.push_back(p);
  }
  std::stable_sort(view.posed.begin(), view.posed.end(),
                   [](const PosedPrimitive& a, const PosedPrimitive& b) { return a.z_min < b.z_min; });
  fill_tiles(view);
  return view;
}

// Distance along the ray (in units of depth) at which it enters the box, and the face; false if it misses.
bool hit_box(const PosedPrimitive& p, const Vector3d& d, Hit& hit, int index) {
  const Vector3d& half = p.primitive->size;
  double enter = kNear;
  double leave = hit.z;
  int face = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double inverse = 1.0 / d[axis];
    const double side = inverse >= 0.0 ? half[axis] : -half[axis];
    const double in = (-side - p.origin[axis]) * inverse;
    const double out = (side - p.origin[axis]) * inverse;
    if (in > enter) {
      enter = in;
      face = 2 * axis + (inverse >= 0.0 ? 0 : 1);
    }
    leave = std::min(leave, out);
    if (enter >= leave) return false;
  }
  if (face < 0) return false;  // the camera is inside
  hit = {enter, index, face};
  return true;
}

bool hit_capsule(const PosedPrimitive& p, const Vector3d& d, Hit& hit, int index) {
  const Vector3d& o = p.origin;
  const double a = d.x() * d.x() + d.y() * d.y();
  const double b = o.x() * d.x() + o.y() * d.y();
  const double c = o.x() * o.x() + o.y() * o.y() - 1.0;
  const double tube = b * b - a * c;
  if (tube < 0.0) return false;  // the round ends lie inside the endless tube
  double z = a > 1e-12 ? (-b - std::sqrt(tube)) / a : -std::numeric_limits<double>::infinity();
  const double along = a > 1e-12 ? o.z() + z * d.z() : o.z();
  if (std::abs(along) > p.half_length) {
    const Vector3d from = o - Vector3d(0, 0, along > 0.0 ? p.half_length : -p.half_length);
    const double aa = d.squaredNorm();
    const double bb = from.dot(d);
    const double ball = bb * bb - aa * (from.squaredNorm() - 1.0);
    if (ball < 0.0) return false;
    z = (-bb - std::sqrt(ball)) / aa;
  }
  if (z <= kNear || z >= hit.z) return false;
  hit = {z, index, 0};
  return true;
}

// Intersects one primitive alone.
bool hit_primitive(const PosedPrimitive& p, double x, double y, Hit& hit, int index) {
  const Vector3d d = p.to_local.col(0) * x + p.to_local.col(1) * y + p.to_local.col(2);
  return p.primitive->shape == Shape::Box ? hit_box(p, d, hit, index) : hit_capsule(p, d, hit, index);
}

Hit cast(const View& view, const std::vector<int>& tile, double x, double y) {
  Hit hit;
  for (const int index : tile) {
    const PosedPrimitive& p = view.posed[index];
    if (p.z_min >= hit.z) break;
    hit_primitive(p, x, y, hit, index);
  }
  return hit;
}

// Averages the texture over the pixel's footprint: `minor` metres wide and stretched to `major` along the
// direction in which the surface falls away from the viewer.
Color sample_material(const View& view, int material_index, const Vector2d& uv, const Vector2d& extent,
                      const Vector2d& stretch, double minor, double major) {
  const Material& material = view.scene.materials[material_index];
  const Texture& texture = view.scene.textures[material.texture];
  Vector2d scale(material.texels_per_metre, material.texels_per_metre);
  Vector2d at = uv + material.offset;
  if (material.fit) {
    scale = {texture.width() / (2.0 * extent.x()), texture.height() / (2.0 * extent.y())};
    at = uv + extent;
  }
  const double count = std::clamp(std::ceil(major / (kStretch * minor)), 1.0, double{kMaxAnisotropy});
  const auto footprint =
      static_cast<float>(std::max(minor, major / count) * kPixelBlur * std::max(scale.x(), scale.y()));
  const Vector2d step = stretch * (major / count);
  Color sum = Color::Zero();
  for (int i = 0; i < static_cast<int>(count); ++i) {
    const Vector2d texel = (at + step * (i + 0.5 - 0.5 * count)).cwiseProduct(scale);
    sum += texture.sample(static_cast<float>(texel.x()), static_cast<float>(texel.y()), footprint);
  }
  return sum / static_cast<float>(count);
}

struct Shaded {
  Color color;
  float incidence;
};

Shaded shade_surface(const View& view, const PosedPrimitive& p, const Hit& hit, const Vector3d& ray) {
  const Vector3d local = p.origin + hit.z * (p.to_local * ray);
  const double pixel = hit.z / view.camera.fx;  // metres per pixel on a surface that faces the camera
  const double ray_length = ray.norm();
  Vector3d normal;
  Vector2d uv;
  Vector2d extent(1, 1);
  Vector2d stretch(0, 0);
  double major = pixel;
  float incidence;
  if (p.primitive->shape == Shape::Box) {
    const int axis = hit.face / 2;
    normal = (hit.face % 2 ? 1.0 : -1.0) * p.R_cp.col(axis);
    incidence = static_cast<float>(-normal.dot(ray) / ray_length);
    const int iu = axis == 0 ? 1 : 0;
    const int iv = axis == 2 ? 1 : 2;
    // Pictures stand upright and are not mirrored when seen from outside: v runs down the side faces.
    const double su = hit.face == 0 || hit.face == 3 ? -1.0 : 1.0;
    uv = {su * local[iu], -local[iv]};
    extent = {p.primitive->size[iu], p.primitive->size[iv]};
    const Vector3d direction = p.R_cp.transpose() * ray;
    stretch = {su * direction[iu], -direction[iv]};
    const double length = stretch.norm();
    stretch = length > 1e-9 ? Vector2d(stretch / length) : Vector2d(0, 0);
    major = pixel / std::max(0.05F, incidence);
  } else {
    const double end = std::clamp(local.z(), -p.half_length, p.half_length);
    const Vector3d outward(local.x(), local.y(), local.z() - end);
    normal = (p.R_cp * p.scale.cwiseInverse().cwiseProduct(outward)).normalized();
    incidence = static_cast<float>(-normal.dot(ray) / ray_length);
    uv = {std::atan2(local.y(), local.x()) * p.scale.x(), local.z() * p.scale.z()};
    major = pixel;
  }
  const Color albedo =
      sample_material(view, p.primitive->materials[hit.face], uv, extent, stretch, pixel, major);
  const Vector3d to_lamp = (view.lamp_c - hit.z * ray).normalized();
  const float light = kAmbient + kDiffuse * static_cast<float>(std::max(0.0, normal.dot(to_lamp)));
  return {(albedo * light).min(255.0F), incidence};
}

Shaded shade(const View& view, const Hit& hit, const Vector3d& ray) {
  if (hit.primitive < 0) return {Color::Constant(kNothing), 0.0F};
  return shade_surface(view, view.posed[hit.primitive], hit, ray);
}

Vector3d ray_of(const Camera& camera, double u, double v) {
  return {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0};
}

const std::vector<int>& tile_of(const View& view, int u, int v) {
  return view.tiles[static_cast<std::size_t>(v / kTile) * view.tile_columns + u / kTile];
}

// First pass: one ray through the centre of every pixel of a row.
void render_row(const View& view, int v, RenderedImages& images, cv::Mat& surface) {
  auto* color = images.color.ptr<cv::Vec3f>(v);
  auto* depth = images.depth.ptr<float>(v);
  auto* incidence = images.incidence.ptr<float>(v);
  auto* label = images.label.ptr<std::uint8_t>(v);
  auto* id = surface.ptr<int>(v);
  for (int u = 0; u < view.camera.width; ++u) {
    const Vector3d ray = ray_of(view.camera, u, v);
    const Hit hit = cast(view, tile_of(view, u, v), ray.x(), ray.y());
    const Shaded shaded = shade(view, hit, ray);
    color[u] = {shaded.color[0], shaded.color[1], shaded.color[2]};
    incidence[u] = shaded.incidence;
    const bool found = hit.primitive >= 0;
    depth[u] = found ? static_cast<float>(hit.z) : 0.0F;
    label[u] = found ? static_cast<std::uint8_t>(view.posed[hit.primitive].primitive->object) : 0;
    id[u] = found ? hit.primitive * 6 + hit.face : -1;
  }
}

// The surfaces of a pixel, each weighted with the number of rays that meet it. A surface is shaded once, in
// the middle of its rays: solids and faces are convex, so it is there too.
Color outline_color(const View& view, const std::vector<int>& tile, int u, int v) {
  constexpr int kRays = static_cast<int>(std::size(kOutlineSamples));
  std::array<Hit, kRays> hits;
  for (int i = 0; i < kRays; ++i) {
    const Vector3d ray = ray_of(view.camera, u + kOutlineSamples[i][0], v + kOutlineSamples[i][1]);
    hits[i] = cast(view, tile, ray.x(), ray.y());
  }
  Color sum = Color::Zero();
  std::array<bool, kRays> done{};
  for (int i = 0; i < kRays; ++i) {
    if (done[i]) continue;
    double du = 0.0;
    double dv = 0.0;
    int count = 0;
    for (int k = i; k < kRays; ++k) {
      if (done[k] || hits[k].primitive != hits[i].primitive || hits[k].face != hits[i].face) continue;
      done[k] = true;
      du += kOutlineSamples[k][0];
      dv += kOutlineSamples[k][1];
      ++count;
    }
    const Vector3d ray = ray_of(view.camera, u + du / count, v + dv / count);
    Hit middle;
    const int index = hits[i].primitive;
    if (index >= 0) hit_primitive(view.posed[index], ray.x(), ray.y(), middle, index);
    sum += shade(view, middle, ray).color * static_cast<float>(count);
  }
  return sum / static_cast<float>(kRays);
}

// Second pass: pixels beside another surface are replaced by the mean of several rays.
void smooth_outlines(const View& view, int v, RenderedImages& images, const cv::Mat& surface) {
  const int* above = surface.ptr<int>(std::max(0, v - 1));
  const int* here = surface.ptr<int>(v);
  const int* below = surface.ptr<int>(std::min(surface.rows - 1, v + 1));
  auto* color = images.color.ptr<cv::Vec3f>(v);
  for (int u = 0; u < surface.cols; ++u) {
    const int left = here[std::max(0, u - 1)];
    const int right = here[std::min(surface.cols - 1, u + 1)];
    if (here[u] == left && here[u] == right && here[u] == above[u] && here[u] == below[u]) continue;
    const Color mean = outline_color(view, tile_of(view, u, v), u, v);
    color[u] = {mean[0], mean[1], mean[2]};
  }
}

}  // namespace

void render(const Scene& scene, const Camera& camera, const SE3& T_wc, double time, unsigned threads,
            RenderedImages& images) {
  images.color.create(camera.height, camera.width, CV_32FC3);
  images.depth.create(camera.height, camera.width, CV_32FC1);
  images.incidence.create(camera.height, camera.width, CV_32FC1);
  images.label.create(camera.height, camera.width, CV_8UC1);
  cv::Mat surface(camera.height, camera.width, CV_32SC1);
  const View view = make_view(scene, camera, T_wc, time);
  const auto rows = static_cast<std::size_t>(camera.height);
  parallel_loop(rows, threads,
                [&](std::size_t v) { render_row(view, static_cast<int>(v), images, surface); });
  parallel_loop(rows, threads,
                [&](std::size_t v) { smooth_outlines(view, static_cast<int>(v), images, surface); });
}

}  // namespace ipl_slam::synthetic
