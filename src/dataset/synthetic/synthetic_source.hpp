#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "dataset/rgbd_frame.hpp"
#include "dataset/synthetic/depth_sensor.hpp"
#include "dataset/synthetic/scene.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// What the built-in renderer draws. The same options give the same bytes, whatever the number of threads.
struct SyntheticOptions {
  std::string scene = "room";
  std::string trajectory = "orbit";
  std::string story = "walk";
  std::string clothes = "plain";
  std::uint64_t seed = 1;
  int frames = 300;
  double fps = 30.0;
  int width = 640;
  int height = 480;
  int people = 0;
  int boxes = 0;
  bool color_noise = true;
  bool depth_noise = true;
  int motion_blur = 1;
  double exposure = 0.015;
  double read_sigma = 1.5;
  double shot_gain = 0.02;
  synthetic::DepthSensorOptions depth_sensor;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("scene", scene, {"room", "white_room", "corridor", "building", "doors"}, "what is drawn");
    v.choice("trajectory", trajectory,
             {"orbit", "sweep", "walk", "loop", "xyz", "rpy", "halfsphere", "static"}, "path of the camera");
    v.choice(
        "story", story, {"walk", "stand", "crowd", "enter", "leave", "push"},
        "what happens. walk: people walk, stop, sit, leave and return, boxes are pushed about. In the "
        "others it happens close before a camera at the station. stand: everybody stands still; crowd: "
        "people walk round close to the camera, four of them cover more than 60 % of the picture; enter, "
        "leave: people come into the picture and stay, or walk out of it; push: the first box is big and "
        "stands still for a third of the time, then moves");
    v.choice("clothes", clothes, {"plain", "printed"}, "what people wear; only prints have corners");
    v.number("seed", seed,
             {0, 9007199254740992.0, "", "every picture, motion and noise value depends on it"});
    v.number("frames", frames, {1, 1000000, "count", "length of the sequence"});
    v.number("fps", fps, {0.1, 1000, "Hz", "frames per second"});
    v.number("width", width, {64, 4096, "px", "image width"});
    v.number("height", height, {48, 4096, "px", "image height"});
    v.number("people", people, {0, 8, "count", "people, who do what the story says"});
    v.number("boxes", boxes,
             {0, 8, "count", "rigid moving things: a box pushed about, the door, more boxes"});
    v.flag("color_noise", color_noise, "add sensor noise to the color image");
    v.flag("depth_noise", depth_noise, "add a depth camera's noise, rounding, range limits and holes");
    v.number("motion_blur", motion_blur,
             {1, 64, "count", "renderings averaged over the exposure; 1 = no blur"});
    v.number("exposure", exposure, {0.0, 1.0, "s", "exposure time, with motion_blur above 1"});
    v.number("read_sigma", read_sigma,
             {0.0, 50.0, "grey value", "standard deviation of color noise in the dark"});
    v.number("shot_gain", shot_gain, {0.0, 10.0, "grey value", "variance of color noise per grey value"});
    v.section("depth_sensor", depth_sensor, "errors of the depth camera");
  }

  /// Throws UserError naming the first value out of range, or what the scene has no room for.
  void check() const;
};

/// One rendered frame with everything that is known about it.
struct SyntheticFrame {
  RgbdFrame rgbd;
  SE3 T_wc;            ///< exact pose at the timestamp; world = scene frame (metres, z up)
  cv::Mat mask;        ///< CV_8UC1, object ids, 0 = structure
  cv::Mat true_depth;  ///< CV_32FC1, metres, 0 = nothing there
};

/// Something with a name in the scene.
struct SyntheticObject {
  int id = 0;  ///< its value in masks
  std::string class_name;
  bool moving = false;  ///< moves at some time during the sequence
  /// Inclusive ranges of frames [first, last] in which it moves, i.e. is elsewhere than one frame before.
  std::vector<std::pair<std::size_t, std::size_t>> moving_frames;
};

/// Renders a sequence frame by frame. Frames do not depend on each other: any can be asked for, from any
/// thread.
class SyntheticSource : public RgbdSource {
 public:
  /// threads render the rows of one frame; 0 = one per core. Throws UserError for options out of range.
  explicit SyntheticSource(const SyntheticOptions& options, unsigned threads = 1);

  [[nodiscard]] std::optional<SourceItem> next() override;
  [[nodiscard]] std::size_t size() const override { return static_cast<std::size_t>(options_.frames); }

  [[nodiscard]] SyntheticFrame render(std::size_t frame) const;
  [[nodiscard]] Camera camera() const { return camera_; }
  /// Seconds, a whole number of microseconds, so that text files keep it exactly.
  [[nodiscard]] double timestamp(std::size_t frame) const;
  [[nodiscard]] SE3 T_wc(std::size_t frame) const;
  /// CV_8UC1, object ids, 0 = structure. Costs a rendering: take it from render() where the images are needed
  /// too.
  [[nodiscard]] cv::Mat instance_mask(std::size_t frame) const;
  [[nodiscard]] const std::vector<SyntheticObject>& objects() const { return objects_; }
  /// Whether the object is elsewhere in this frame than in the one before (in frame 0: than in the next).
  [[nodiscard]] bool moves(int object_id, std::size_t frame) const;
  [[nodiscard]] const SyntheticOptions& options() const { return options_; }
  [[nodiscard]] const synthetic::Scene& scene() const { return scene_; }

 private:
  [[nodiscard]] cv::Mat blurred_color(double time) const;
  void find_moving_frames();

  SyntheticOptions options_;
  unsigned threads_;
  Camera camera_;
  synthetic::Scene scene_;
  std::vector<SyntheticObject> objects_;
  std::size_t position_ = 0;
};

}  // namespace ipl_slam
