#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/options.hpp"
#include "dense/dense_map.hpp"
#include "dynamics/contour_window.hpp"
#include "dynamics/dynamic_features.hpp"
#include "features/line_extractor.hpp"
#include "features/orb_extractor.hpp"
#include "geometry/depth_noise.hpp"
#include "loop/loop_closer.hpp"
#include "mapping/keyframe_policy.hpp"
#include "mapping/local_mapper.hpp"
#include "segmentation/instance_tracker.hpp"
#include "segmentation/make_segmenter.hpp"
#include "tracking/tracker.hpp"

namespace ipl_slam {

struct ScheduleOptions {
  std::string mode = "lockstep";
  std::uint64_t seed = 0;
  int threads = 1;
  int frame_queue = 2;
  int keyframe_queue = 3;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice(
        "mode", mode, {"lockstep", "realtime"},
        "lockstep: stages in fixed order, same input gives the same bytes; realtime: segmentation, contour "
        "window, line extraction and mapping on threads of their own");
    v.number("seed", seed, {0, 9007199254740992.0, "", "every random choice depends on it"});
    v.number("threads", threads,
             {1, 64, "count", "threads inside a stage; the result does not depend on it"});
    v.number("frame_queue", frame_queue,
             {1, 1000, "frames", "realtime: frames that may wait before the oldest is dropped"});
    v.number("keyframe_queue", keyframe_queue,
             {1, 1000, "keyframes",
              "realtime: keyframes that may wait for the mapper; no new one is made while it is full"});
  }
};

struct FeatureOptions {
  std::string lines = "edges";
  double noise = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("lines", lines, {"off", "lsd", "edges"},
             "lines beside points, and how they are found in keyframes: lsd = line segment detector, edges = "
             "our own");
    v.number(
        "noise", noise,
        {0.0, 50.0, "grey values",
         "for tests: standard deviation of noise added to the image before features are taken, another with "
         "every schedule.seed"});
  }
};

/// Everything that can be set, stage by stage. Section names are the names of the stages.
struct Config {
  ScheduleOptions schedule;
  DepthNoiseOptions depth;
  FeatureOptions features;
  OrbOptions orb;
  LineOptions lines;
  SegmentationOptions segmentation;
  InstanceTrackerOptions instances;
  MaskCarrierOptions mask_carrier;
  ContourWindowOptions contours;
  DynamicsOptions dynamics;
  TrackerOptions tracking;
  KeyframePolicyOptions keyframes;
  MappingOptions mapping;
  LoopOptions loops;
  DenseOptions dense;

  template <class Visitor>
  void visit(Visitor& v) {
    v.section("schedule", schedule, "order and threads in which the stages run");
    v.section("depth", depth, "the depth camera");
    v.section("features", features, "what is looked for in the images");
    v.section("orb", orb, "point features");
    v.section("lines", lines, "line features of keyframes");
    v.section("segmentation", segmentation, "who is in the picture");
    v.section("instances", instances, "instances followed from frame to frame");
    v.section("mask_carrier", mask_carrier, "masks brought from one frame to another");
    v.section("contours", contours, "which instances move, by the similarity of their contours");
    v.section("dynamics", dynamics, "what is dynamic and leaves the pose and the map alone");
    v.section("tracking", tracking, "camera pose of every frame");
    v.section("keyframes", keyframes, "which frames enter the map");
    v.section("mapping", mapping, "landmarks and keyframes");
    v.section("loops", loops, "known places recognised");
    v.section("dense", dense, "the static semantic cloud");
  }
};

/// The named presets: "default", every choice as it measured best, and "paper", as the IPL-SLAM paper and
/// ORB-SLAM2, which it builds on, have it. Throws UserError for any other name.
[[nodiscard]] Config preset(std::string_view name);
[[nodiscard]] std::vector<std::string> preset_names();
/// The line detector that features.lines names; nothing for off.
[[nodiscard]] std::optional<LineMethod> line_method(const FeatureOptions& options);
/// Settings of the dynamics stage. Without lines theirs is off: Algorithm 1 goes by points alone then.
[[nodiscard]] DynamicsOptions dynamics_options(const Config& config);
/// Throws UserError for values that cannot stand together, though each is in its range.
void check(const Config& config);

}  // namespace ipl_slam
