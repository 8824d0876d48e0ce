#include "pipeline/config.hpp"

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {

std::vector<std::string> preset_names() {
  return {"default", "paper"};
}

Config preset(std::string_view name) {
  Config config;
  if (name == "default") return config;
  if (name == "paper") {
    // ORB-SLAM2's virtual stereo camera (baseline x focal length = 40 pixel metres): a pixel of disparity
    // noise is this much noise in inverse depth.
    config.depth.inverse_depth_sigma = 1.0 / 40.0;
    config.keyframes.max_interval = 1.0;
    config.segmentation.yolo.image_side = 640;  // the paper does not say; it is what YOLOv8 is trained for
    config.contours = paper_contour_window();
    config.features.lines = "lsd";
    config.dynamics = paper_dynamics();
    return config;
  }
  throw UserError(fmt::format("unknown preset '{}': use default or paper", name));
}

std::optional<LineMethod> line_method(const FeatureOptions& options) {
  if (options.lines == "lsd") return LineMethod::kLsd;
  if (options.lines == "edges") return LineMethod::kEdges;
  return std::nullopt;
}

DynamicsOptions dynamics_options(const Config& config) {
  DynamicsOptions options = config.dynamics;
  if (!line_method(config.features)) options.lines.check = "off";
  return options;
}

void check(const Config& config) {
  check_options(config);
  check(config.contours);
  if (config.orb.fast_min_threshold > config.orb.fast_threshold) {
    throw UserError(fmt::format(
        "orb.fast_min_threshold ({}) is above orb.fast_threshold ({}); lower the one or raise the other",
        config.orb.fast_min_threshold, config.orb.fast_threshold));
  }
  if (config.loops.confirmations > config.loops.witnesses) {
    throw UserError(
        fmt::format("loops.confirmations ({}) is above loops.witnesses ({}): no loop could be closed; lower "
                    "the one or raise "
                    "the other",
                    config.loops.confirmations, config.loops.witnesses));
  }
  const VolumeOptions& volume = config.dense.volume;
  if (volume.truncation < 2.0 * volume.voxel) {
    throw UserError(fmt::format(
        "dense.volume.truncation ({} m) is less than two voxels (dense.volume.voxel = {} m): surfaces "
        "would have holes; 4 voxels are usual",
        volume.truncation, volume.voxel));
  }
  const RegionBeliefOptions& belief = config.dynamics.belief;
  if (belief.moved_on_still >= belief.moved_on_mover) {
    throw UserError(
        fmt::format("dynamics.belief.moved_on_still ({}) is not below dynamics.belief.moved_on_mover ({}): "
                    "points and lines could tell nothing; lower the one or raise the other",
                    belief.moved_on_still, belief.moved_on_mover));
  }
}

}  // namespace ipl_slam
