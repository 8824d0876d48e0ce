#include "pipeline/loaded_map.hpp"

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "map/map_file.hpp"

namespace ipl_slam {
namespace {

bool same(const Camera& a, const Camera& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy && a.k1 == b.k1 && a.k2 == b.k2 && a.p1 == b.p1 && a.p2 == b.p2 && a.k3 == b.k3;
}

}  // namespace

Map load_fitting_map(const std::filesystem::path& file, const Camera& camera, const Config& config) {
  SavedMap saved = load_map(file);
  if (!same(saved.camera, camera)) {
    throw UserError(
        fmt::format("'{}' was made with another camera ({}x{}, fx {:g}, fy {:g}) than this one ({}x{}, fx "
                    "{:g}, fy {:g}): "
                    "give its camera with --camera",
                    file.string(), saved.camera.width, saved.camera.height, saved.camera.fx, saved.camera.fy,
                    camera.width, camera.height, camera.fx, camera.fy));
  }
  const ScalePyramid& pyramid = saved.map.pyramid();
  if (pyramid.levels() != config.orb.levels || pyramid.factor() != config.orb.scale_factor) {
    throw UserError(fmt::format("'{}' was made with orb.levels={} and orb.scale_factor={:g}: set them alike",
                                file.string(), pyramid.levels(), pyramid.factor()));
  }
  if (saved.map.keyframes().size() == 0) {
    throw UserError(fmt::format("'{}' holds no keyframe: there is nothing to go on with", file.string()));
  }
  return std::move(saved.map);
}

}  // namespace ipl_slam
