#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "common/log.hpp"
#include "common/text_file.hpp"
#include "dataset/trajectory.hpp"
#include "dense/cloud_file.hpp"
#include "dense/cloud_renderer.hpp"
#include "dense/upright.hpp"
#include "dense/viewpoint.hpp"
#include "output.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;

constexpr Rgb kPathColor{220, 30, 30}, kCameraColor{30, 90, 220};
constexpr double kCameraDepth = 0.3;  // m, of the drawn pyramid of view

struct RenderArguments {
  std::string input, output;
  std::string view = "orbit", color = "image", background = "white", size = "1280x720", trajectory, up = "-y";
  double azimuth = 225.0, elevation = 35.0;
  std::optional<std::size_t> at;
  int frames = 1;
  double point_size = 0.0;
  bool all_faces = false;
};

cv::Size parse_size(const std::string& text) {
  constexpr double kLeast = 16, kMost = 8192;
  const std::size_t middle = text.find('x');
  if (middle != std::string::npos) {
    const auto width = parse_number(std::string_view(text).substr(0, middle));
    const auto height = parse_number(std::string_view(text).substr(middle + 1));
    const auto fits = [](double v) { return v >= kLeast && v <= kMost; };
    if (width && height && fits(*width) && fits(*height)) {
      return {static_cast<int>(*width), static_cast<int>(*height)};
    }
  }
  throw UserError(
      fmt::format("--size {} is not understood; give width and height in pixels, {} to {}, as 1280x720", text,
                  kLeast, kMost));
}

PictureColors parse_colors(const std::string& name) {
  if (name == "labels") return PictureColors::kLabels;
  if (name == "normals") return PictureColors::kNormals;
  if (name == "height") return PictureColors::kHeight;
  if (name == "confidence") return PictureColors::kConfidence;
  return PictureColors::kImage;
}

// An axis of the world by its name, e.g. "-y".
Eigen::Vector3d parse_axis(const std::string& name) {
  const Eigen::Vector3d axis = Eigen::Vector3d::Unit(name.back() - 'x');
  return name.front() == '-' ? Eigen::Vector3d(-axis) : axis;
}

// The cloud's own file, and that of the trajectory beside it where there is one.
struct Input {
  fs::path cloud;
  std::optional<fs::path> trajectory;
};

Input find_input(const RenderArguments& a) {
  Input input{a.input, std::nullopt};
  if (fs::is_directory(input.cloud)) {
    const fs::path run = input.cloud;
    input.cloud = run / "cloud.ply";
    if (!fs::exists(input.cloud)) {
      throw UserError(fmt::format(
          "'{}' holds no cloud.ply; give a folder that 'ipl_slam run' wrote, or a cloud", run.string()));
    }
    if (fs::exists(run / "trajectory.txt")) input.trajectory = run / "trajectory.txt";
  }
  if (a.trajectory == "off")
    input.trajectory.reset();
  else if (!a.trajectory.empty())
    input.trajectory = a.trajectory;
  return input;
}

const SE3& pose_at(const Trajectory& trajectory, const std::optional<std::size_t>& at) {
  if (trajectory.empty()) {
    throw UserError(
        "--view trajectory needs a trajectory; give one with --trajectory FILE, or a run's folder");
  }
  const std::size_t index = at.value_or(trajectory.size() / 2);
  if (index >= trajectory.size()) {
    throw UserError(fmt::format("--at {} lies behind the trajectory's end; it has poses 0 to {}", index,
                                trajectory.size() - 1));
  }
  return trajectory[index].T_wc;
}

// Everything a picture shows but where it is taken from.
struct Scene {
  SemanticCloud cloud;
  Trajectory trajectory;
  Upright upright;
  std::vector<PictureLine> lines;
};

Scene load_scene(const RenderArguments& a) {
  const Input input = find_input(a);
  Scene scene;
  scene.cloud = read_cloud(input.cloud);
  if (scene.cloud.points.empty()) throw UserError(fmt::format("'{}' holds no points", input.cloud.string()));
  if (input.trajectory) {
    std::size_t rejected = 0;
    scene.trajectory = read_trajectory(*input.trajectory, &rejected);
    if (rejected > 0) log().warn("{}", rejected_lines(input.trajectory->string(), rejected));
    scene.lines.push_back(path_line(scene.trajectory, kPathColor));
  }
  // The first camera of this program's clouds looks along z; other clouds that stand upright have x there.
  const Eigen::Vector3d up = parse_axis(a.up);
  const Eigen::Vector3d ahead = up.z() == 0.0 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  scene.upright = upright_frame(scene.cloud, scene.trajectory, {}, up, ahead);
  if (!scene.upright.level_was_found) log().warn("no level surface was found: up is a guess");
  return scene;
}

Viewpoint viewpoint(const RenderArguments& a, const Scene& scene, double azimuth) {
  const cv::Size size = parse_size(a.size);
  if (a.view == "top") return top_view(scene.cloud, scene.upright, size);
  if (a.view == "trajectory") return trajectory_view(pose_at(scene.trajectory, a.at), scene.upright, size);
  return orbit_view(scene.cloud, scene.upright, azimuth, a.elevation, size);
}

void run_render(const RenderArguments& a) {
  const bool is_orbit = a.view == "orbit";
  if (a.frames > 1 && !is_orbit) throw UserError("--frames goes with --view orbit only");
  (void)parse_size(a.size);  // before a large cloud is read
  if (a.frames == 1) check_writable(a.output);
  Scene scene = load_scene(a);
  if (a.view == "trajectory") {
    scene.lines.push_back(camera_line(pose_at(scene.trajectory, a.at), kCameraDepth, kCameraColor));
  }
  PictureStyle style;
  style.colors = parse_colors(a.color);
  if (a.background == "dark") style.background = {24, 26, 30};
  style.point_size = a.point_size;
  style.all_faces = a.all_faces;
  const auto draw = [&](double azimuth) {
    return draw_cloud(scene.cloud, viewpoint(a, scene, azimuth), scene.upright, scene.lines, style);
  };
  if (a.frames == 1) {
    write_image_atomically(a.output, draw(a.azimuth));
  } else {
    make_folder(a.output);
    for (int i = 0; i < a.frames; ++i) {
      write_image_atomically(fs::path(a.output) / fmt::format("{:04}.png", i),
                             draw(a.azimuth + 360.0 * i / a.frames));
    }
  }
  log().info("{} points, {} classes; wrote {}", scene.cloud.points.size(), scene.cloud.classes.size(),
             a.output);
}

}  // namespace

void add_render_verb(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("render", "Draw a picture of a point cloud, without a graphics card");
  const auto a = std::make_shared<RenderArguments>();
  verb->add_option(
          "input", a->input,
          "A folder that 'run' wrote (its cloud.ply and trajectory.txt are shown), or a cloud: PLY or PCD")
      ->type_name("RUN_DIR|CLOUD")
      ->required();
  verb->add_option("-o,--output", a->output, "The picture; with --frames the folder for the pictures")
      ->type_name("PNG")
      ->required();
  verb->add_option(
          "--view", a->view,
          "From where: orbit (from outside), top (a plan), trajectory (from behind a pose of the camera)")
      ->check(CLI::IsMember({"orbit", "top", "trajectory"}))
      ->capture_default_str();
  verb->add_option(
          "--azimuth", a->azimuth,
          "orbit: degrees anticlockwise, seen from above; at 180 one looks the way the first camera did")
      ->check(CLI::Range(-3600.0, 3600.0))
      ->capture_default_str();
  verb->add_option("--elevation", a->elevation, "orbit: degrees above the horizon")
      ->check(CLI::Range(-90.0, 90.0))
      ->capture_default_str();
  verb->add_option("--frames", a->frames, "orbit: so many pictures, once around, 0000.png and on")
      ->check(CLI::Range(1, 9999))
      ->capture_default_str();
  verb->add_option("--at", a->at, "trajectory: the pose, counted from 0; the middle one unless given")
      ->type_name("N");
  verb->add_option("--size", a->size, "Width and height of the picture, pixels")
      ->type_name("WxH")
      ->capture_default_str();
  verb->add_option(
          "--color", a->color,
          "What colours mean: image (as the cameras saw it), labels (classes, with a legend), normals, "
          "height, or confidence (of the labels)")
      ->check(CLI::IsMember({"image", "labels", "normals", "height", "confidence"}))
      ->capture_default_str();
  verb->add_option("--trajectory", a->trajectory,
                   "Trajectory to draw (TUM format), or off; that of the run's folder unless given")
      ->type_name("FILE|off");
  verb->add_option("--background", a->background, "Colour where nothing is: white or dark")
      ->check(CLI::IsMember({"white", "dark"}))
      ->capture_default_str();
  verb->add_option("--point-size", a->point_size, "Size of a point in metres; 0 = such that neighbours touch")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  verb->add_option(
          "--up", a->up,
          "What is about up where no trajectory tells: -y in clouds of this program, z in many others")
      ->check(CLI::IsMember({"x", "-x", "y", "-y", "z", "-z"}))
      ->capture_default_str();
  verb->add_flag("--all-faces", a->all_faces,
                 "Draw also surfaces seen from behind, e.g. the ceiling from above and walls from outside");
  verb->callback([a] { run_render(*a); });
}

}  // namespace ipl_slam::cli
