#include "dataset/synthetic/synthetic_source.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <ipl_slam/error.hpp>

#include "common/random.hpp"
#include "dataset/synthetic/building.hpp"
#include "dataset/synthetic/camera_path.hpp"
#include "dataset/synthetic/corridor.hpp"
#include "dataset/synthetic/doors.hpp"
#include "dataset/synthetic/renderer.hpp"
#include "dataset/synthetic/room.hpp"
#include "dataset/synthetic/story.hpp"
#include "dataset/synthetic/white_room.hpp"

namespace ipl_slam {
namespace {

// A part that is displaced by less than this between two frames, metres or radians, counts as still.
constexpr double kStill = 1e-5;

// Checks each setting against its declared limits.
struct RangeCheck {
  template <class T>
  void number(const char* name, const T& value, const NumberInfo& info) {
    const auto number = static_cast<double>(value);
    if (number >= info.min && number <= info.max) return;
    throw UserError(
        fmt::format("synthetic {} is {}: give a value from {} to {}", name, number, info.min, info.max));
  }
  void flag(const char*, bool&, const char*) {}
  void choice(const char* name, const std::string& value, std::initializer_list<const char*> allowed,
              const char*) {
    std::string list;
    for (const char* one : allowed) {
      if (value == one) return;
      list += (list.empty() ? "" : ", ") + std::string(one);
    }
    throw UserError(fmt::format("synthetic {} '{}' is not known: use one of {}", name, value, list));
  }
  template <class Section>
  void section(const char*, Section& section, const char*) {
    section.visit(*this);
  }
};

SyntheticOptions checked(const SyntheticOptions& options) {
  options.check();
  return options;
}

Camera make_camera(const SyntheticOptions& options) {
  Camera camera;
  camera.name = "synthetic";
  camera.width = options.width;
  camera.height = options.height;
  camera.fx = camera.fy = 525.0 * options.width / 640.0;
  camera.cx = 0.5 * (options.width - 1);
  camera.cy = 0.5 * (options.height - 1);
  return camera;
}

bool has_loop(const std::string& scene) {
  return scene == "building" || scene == "doors";
}

synthetic::Scene make_scene(const SyntheticOptions& options) {
  if (options.scene == "white_room") return synthetic::make_white_room(options.seed);
  if (options.scene == "corridor") return synthetic::make_corridor(options.seed);
  const auto clothes = options.clothes == "printed" ? synthetic::Clothes::Printed : synthetic::Clothes::Plain;
  const double duration = options.frames / options.fps;
  if (has_loop(options.scene)) {
    const synthetic::PassersBy people = {options.seed, clothes, options.people, duration};
    return options.scene == "doors" ? synthetic::make_doors(people) : synthetic::make_building(people);
  }
  synthetic::RoomContents contents;
  contents.seed = options.seed;
  contents.story = options.story;
  contents.clothes = clothes;
  contents.people = options.people;
  contents.boxes = options.boxes;
  contents.duration = duration;
  const synthetic::CameraSite site = synthetic::room_camera_site();
  contents.camera_position = [site, path = options.trajectory](double time) {
    return synthetic::camera_pose(path, site, time).translation();
  };
  return synthetic::make_room(contents);
}

void check_story(const SyntheticOptions& o) {
  if (o.scene != "room") throw UserError(fmt::format("story '{}' plays in the scene room", o.story));
  if (o.trajectory == "orbit" || o.trajectory == "sweep" || o.trajectory == "walk") {
    throw UserError(fmt::format(
        "story '{}' plays before a camera at the station: use the trajectory xyz, rpy, halfsphere "
        "or static",
        o.story));
  }
  if (synthetic::has_roles(o.story) && (o.people < 1 || o.people > synthetic::kStagePlaces)) {
    throw UserError(fmt::format("story '{}' is about people: give people from 1 to {}", o.story,
                                synthetic::kStagePlaces));
  }
  if (o.story == "push" && o.boxes < 1) {
    throw UserError("story 'push' is about a box: give boxes, at least 1");
  }
}

double displacement(const SE3& a, const SE3& b) {
  const SE3 delta = a.inverse() * b;
  return std::max(delta.translation().norm(), delta.angle());
}

}  // namespace

void SyntheticOptions::check() const {
  SyntheticOptions copy = *this;
  RangeCheck range_check;
  copy.visit(range_check);
  if (story != "walk") check_story(*this);
  if (has_loop(scene) != (trajectory == "loop")) {
    throw UserError(
        fmt::format("scene '{}' and trajectory '{}' do not fit: the trajectory loop is that of the scenes "
                    "building and doors",
                    scene, trajectory));
  }
  if (has_loop(scene) && boxes > 0) {
    throw UserError(fmt::format("scene '{}' has no room for boxes: use the scene room", scene));
  }
  if (scene == "room" || has_loop(scene)) return;
  if (people > 0 || boxes > 0) {
    throw UserError(fmt::format("scene '{}' has no room for people or boxes: use the scene room", scene));
  }
  if (scene == "corridor" && (trajectory == "orbit" || trajectory == "sweep")) {
    throw UserError(fmt::format(
        "a corridor is too narrow for the trajectory {}: use walk, xyz, rpy, halfsphere or static",
        trajectory));
  }
}

SyntheticSource::SyntheticSource(const SyntheticOptions& options, unsigned threads)
    : options_(checked(options)),
      threads_(threads),
      camera_(make_camera(options)),
      scene_(make_scene(options)) {
  find_moving_frames();
}

void SyntheticSource::find_moving_frames() {
  for (const synthetic::SceneObject& object : scene_.objects)
    objects_.push_back({object.id, object.class_name, false, {}});
  std::vector<SE3> before = scene_.frames(timestamp(0));
  // Frame 0 has none before it: it takes the answer of frame 1.
  for (std::size_t frame = 1; frame < std::max<std::size_t>(2, size()); ++frame) {
    std::vector<SE3> now = scene_.frames(timestamp(frame));
    for (const synthetic::SceneObject& object : scene_.objects) {
      bool moved = false;
      for (int k = 0; k < object.frame_count && !moved; ++k) {
        const int index = object.first_frame + k;
        moved = displacement(before[index], now[index]) > kStill;
      }
      if (!moved) continue;
      SyntheticObject& named = objects_[object.id - 1];
      named.moving = true;
      auto& ranges = named.moving_frames;
      if (!ranges.empty() && ranges.back().second + 1 == frame) {
        ranges.back().second = frame;
      } else {
        ranges.emplace_back(frame == 1 ? 0 : frame, frame);
      }
    }
    before = std::move(now);
  }
  for (SyntheticObject& object : objects_) {
    for (auto& range : object.moving_frames) range.second = std::min(range.second, size() - 1);
  }
}

bool SyntheticSource::moves(int object_id, std::size_t frame) const {
  const auto& ranges = objects_.at(static_cast<std::size_t>(object_id) - 1).moving_frames;
  return std::any_of(ranges.begin(), ranges.end(),
                     [&](const auto& range) { return range.first <= frame && frame <= range.second; });
}

double SyntheticSource::timestamp(std::size_t frame) const {
  return std::round(static_cast<double>(frame) / options_.fps * 1e6) / 1e6;
}

SE3 SyntheticSource::T_wc(std::size_t frame) const {
  return synthetic::camera_pose(options_.trajectory, scene_.site, timestamp(frame));
}

cv::Mat SyntheticSource::instance_mask(std::size_t frame) const {
  synthetic::RenderedImages images;
  synthetic::render(scene_, camera_, T_wc(frame), timestamp(frame), threads_, images);
  return images.label;
}

// Mean of what is seen at evenly spaced moments of the exposure, whose middle is `time`.
cv::Mat SyntheticSource::blurred_color(double time) const {
  cv::Mat sum;
  synthetic::RenderedImages images;
  for (int i = 0; i < options_.motion_blur; ++i) {
    const double moment = time + options_.exposure * ((i + 0.5) / options_.motion_blur - 0.5);
    const SE3 T_wc = synthetic::camera_pose(options_.trajectory, scene_.site, moment);
    synthetic::render(scene_, camera_, T_wc, moment, threads_, images);
    if (i == 0) {
      sum = images.color.clone();
    } else {
      sum += images.color;
    }
  }
  sum *= 1.0 / options_.motion_blur;
  return sum;
}

SyntheticFrame SyntheticSource::render(std::size_t frame) const {
  const double time = timestamp(frame);
  SyntheticFrame result;
  result.T_wc = T_wc(frame);
  synthetic::RenderedImages images;
  synthetic::render(scene_, camera_, result.T_wc, time, threads_, images);
  if (options_.motion_blur > 1 && options_.exposure > 0.0) images.color = blurred_color(time);

  if (scene_.softness > 0.0) {
    cv::GaussianBlur(images.color, images.color, {}, scene_.softness * options_.width / 640.0);
  }

  const std::uint64_t noise = hash64(hash64(options_.seed, 3), frame);
  const bool noisy = options_.color_noise;
  result.rgbd.index = frame;
  result.rgbd.timestamp = time;
  result.rgbd.color = synthetic::expose_color(images.color, noisy ? options_.read_sigma : 0.0,
                                              noisy ? options_.shot_gain : 0.0, hash64(noise, 1));
  const cv::Mat measured = options_.depth_noise
                               ? synthetic::measure_depth(images.depth, images.incidence, camera_,
                                                          options_.depth_sensor, hash64(noise, 2))
                               : images.depth;
  result.rgbd.depth = synthetic::depth_to_raw(measured, camera_.depth_scale);
  result.mask = images.label;
  result.true_depth = images.depth;
  return result;
}

std::optional<SourceItem> SyntheticSource::next() {
  if (position_ >= size()) return std::nullopt;
  SourceItem item;
  item.frame = render(position_++).rgbd;
  item.timestamp = item.frame->timestamp;
  return item;
}

}  // namespace ipl_slam
