#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <ipl_slam/slam.hpp>

#include "common/atomic_file.hpp"
#include "dataset/camera_config.hpp"
#include "dense/cloud_file.hpp"
#include "map/map_file.hpp"
#include "pipeline/loaded_map.hpp"
#include "pipeline/pipeline.hpp"

namespace ipl_slam {
namespace {

Camera to_camera(const CameraParameters& p) {
  Camera camera{"custom", p.width, p.height, p.fx, p.fy, p.cx,         p.cy,
                p.k1,     p.k2,    p.p1,     p.p2, p.k3, p.depth_scale};
  camera.check();
  return camera;
}

CameraParameters to_parameters(const Camera& c) {
  return {c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3, c.depth_scale};
}

Pose to_pose(const SE3& T) {
  const Eigen::Vector3d& t = T.translation();
  const Eigen::Quaterniond& q = T.rotation();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

std::vector<TimedPose> to_poses(const Trajectory& trajectory) {
  std::vector<TimedPose> poses;
  for (const StampedPose& p : trajectory) poses.push_back({p.timestamp, to_pose(p.T_wc)});
  return poses;
}

std::vector<SeenInstance> to_seen(const std::vector<InstanceRecord>& records) {
  std::vector<SeenInstance> seen;
  for (const InstanceRecord& r : records) {
    seen.push_back({r.id.value, r.class_name, r.score, r.box.x, r.box.y, r.box.width, r.box.height,
                    r.verdict ? r.verdict->state : MotionState::kCandidate});
  }
  return seen;
}

int matrix_type(PixelFormat format) {
  switch (format) {
    case PixelFormat::kBgr8:
    case PixelFormat::kRgb8:
      return CV_8UC3;
    case PixelFormat::kGray8:
      return CV_8UC1;
    case PixelFormat::kDepth16:
      return CV_16UC1;
  }
  throw std::invalid_argument("unknown pixel format");
}

// A header over the caller's pixels; nothing is copied.
cv::Mat wrap(const ImageView& view, const char* what) {
  if (view.data == nullptr || view.width <= 0 || view.height <= 0) {
    throw std::invalid_argument(fmt::format("the {} image is empty", what));
  }
  const int type = matrix_type(view.format);
  const std::size_t row = static_cast<std::size_t>(view.width) * CV_ELEM_SIZE(type);
  if (view.stride_bytes != 0 && view.stride_bytes < row) {
    throw std::invalid_argument(fmt::format("the {} image's stride of {} bytes is less than a row of {}",
                                            what, view.stride_bytes, row));
  }
  // OpenCV wants a pointer it could write through; the pipeline only reads.
  return {view.height, view.width, type, const_cast<void*>(view.data),
          view.stride_bytes == 0 ? static_cast<std::size_t>(cv::Mat::AUTO_STEP) : view.stride_bytes};
}

Config load_config(const SlamOptions& options) {
  Config config = preset(options.preset);
  if (!options.config_file.empty()) load_options(config, options.config_file);
  for (const std::string& setting : options.overrides) set_option(config, setting);
  check(config);
  return config;
}

Pipeline make_pipeline(const Camera& camera, const SlamOptions& options) {
  const Config config = load_config(options);
  if (options.map_file.empty()) return {camera, config, std::nullopt, options.localize_only};
  return {camera, config, load_fitting_map(options.map_file, camera, config), options.localize_only};
}

}  // namespace

CameraParameters CameraParameters::preset(const std::string& name) {
  const std::vector<std::string>& names = camera_presets();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    throw UserError(fmt::format("unknown camera '{}': use {}, or load a file", name, fmt::join(names, ", ")));
  }
  return to_parameters(load_camera(name));
}

CameraParameters CameraParameters::load(const std::filesystem::path& file) {
  return to_parameters(load_camera(file.string()));
}

class Slam::Impl {
 public:
  Impl(const CameraParameters& camera, const SlamOptions& options)
      : pipeline(make_pipeline(to_camera(camera), options)) {}

  Pipeline pipeline;
  std::size_t frames = 0;
};

Slam::Slam(const CameraParameters& camera, const SlamOptions& options)
    : impl_(std::make_unique<Impl>(camera, options)) {}
Slam::~Slam() = default;
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&&) noexcept = default;

TrackingResult Slam::process(const ImageView& color, const ImageView& depth, double timestamp) {
  RgbdFrame frame;
  frame.index = impl_->frames;
  frame.timestamp = timestamp;
  if (color.format == PixelFormat::kDepth16)
    throw std::invalid_argument("the color image has the format kDepth16");
  if (depth.format != PixelFormat::kDepth16)
    throw std::invalid_argument("the depth image has not the format kDepth16");
  // Copies: stages keep the images of some frames, and the caller's pixels are theirs after this call.
  const cv::Mat theirs = wrap(color, "color");
  color.format == PixelFormat::kRgb8 ? cv::cvtColor(theirs, frame.color, cv::COLOR_RGB2BGR)
                                     : theirs.copyTo(frame.color);
  frame.depth = wrap(depth, "depth").clone();
  const FrameResult result = impl_->pipeline.process(frame);
  ++impl_->frames;
  return {result.state,    to_pose(result.T_wc), result.inliers, result.keyframe, to_seen(result.instances),
          result.mask_age, result.lines};
}

std::vector<std::uint8_t> Slam::instance_mask(std::uint32_t id) const {
  for (const TrackedInstance& tracked : impl_->pipeline.last_instances()) {
    if (tracked.id.value != id) continue;
    const cv::Mat image = tracked.instance.mask.to_image();
    return {image.datastart, image.dataend};
  }
  return {};
}

// With schedule.mode=realtime the mapper may still be at work: what these return is what it leaves.
std::vector<TimedPose> Slam::trajectory() const {
  impl_->pipeline.finish();
  return to_poses(impl_->pipeline.trajectory());
}
std::vector<TimedPose> Slam::keyframes() const {
  impl_->pipeline.finish();
  return to_poses(impl_->pipeline.keyframe_trajectory());
}

void Slam::save_trajectory(const std::filesystem::path& file) const {
  impl_->pipeline.finish();
  write_trajectory(file, impl_->pipeline.trajectory());
}

void Slam::save_map(const std::filesystem::path& file) const {
  impl_->pipeline.finish();
  impl_->pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
    if (map.keyframes().size() == 0) {
      throw UserError(fmt::format("'{}' was not written: no map could be started yet", file.string()));
    }
    ipl_slam::save_map(file, map, impl_->pipeline.camera());
  });
}

void Slam::save_cloud(const std::filesystem::path& file) const {
  impl_->pipeline.finish();
  if (impl_->pipeline.dense() == nullptr) {
    throw UserError(fmt::format(
        "'{}' was not written: no cloud is made with dense.enabled=false or localize_only", file.string()));
  }
  const SemanticCloud cloud = impl_->pipeline.fuse().cloud;
  if (cloud.points.empty()) {
    throw UserError(fmt::format("'{}' was not written: nothing was mapped yet", file.string()));
  }
  write_file_atomically(file, file.extension() == ".pcd" ? cloud_pcd(cloud) : cloud_ply(cloud));
}

}  // namespace ipl_slam
