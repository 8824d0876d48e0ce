#include "pipeline/loaded_map.hpp"

#include <string>
#include <utility>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "map/map_file.hpp"

namespace ipl_slam {
namespace {

// The first thing in which two cameras differ, "fx 525 against 517.3"; empty where they are alike.
std::string difference(const Camera& saved, const Camera& own) {
  const std::pair<const char*, double Camera::*> numbers[] = {
      {"fx", &Camera::fx}, {"fy", &Camera::fy}, {"cx", &Camera::cx}, {"cy", &Camera::cy}, {"k1", &Camera::k1},
      {"k2", &Camera::k2}, {"p1", &Camera::p1}, {"p2", &Camera::p2}, {"k3", &Camera::k3}};
  if (saved.width != own.width || saved.height != own.height) {
    return fmt::format("{}x{} pixels against {}x{}", saved.width, saved.height, own.width, own.height);
  }
  for (const auto& [name, number] : numbers) {
    if (saved.*number != own.*number) {
      return fmt::format("{} {} against {}", name, saved.*number, own.*number);
    }
  }
  return "";
}

}  // namespace

Map load_fitting_map(const std::filesystem::path& file, const Camera& camera, const Config& config) {
  SavedMap saved = load_map(file);
  if (const std::string what = difference(saved.camera, camera); !what.empty()) {
    throw UserError(fmt::format(
        "'{}' was made with another camera than this one ({}): give the camera it was made with (--camera)",
        file.string(), what));
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
