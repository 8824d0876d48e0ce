#include "dense/dense_map.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "dataset/camera_config.hpp"
#include "dense/marching_cubes.hpp"

namespace ipl_slam {
namespace {

// Where most surfaces are, m before the camera.
constexpr double kUsualDepth = 2.0;

// By how much a surface before the camera moves between two poses, m.
double displacement(const SE3& T_cw, const SE3& T_other_w) {
  const SE3 difference = T_cw * T_other_w.inverse();
  return difference.translation().norm() + difference.angle() * kUsualDepth;
}

void call(const std::function<void()>& progress) {
  if (progress) progress();
}

}  // namespace

DenseMap::DenseMap(const Camera& camera, const DenseOptions& options)
    : camera_(pinhole(camera)),
      options_(options),
      maker_(camera),
      views_({camera.width, camera.height}),
      volume_(camera_, options.volume) {}

void DenseMap::add(KeyframeId id, double timestamp, const cv::Mat& color, const cv::Mat& depth,
                   const std::vector<TrackedInstance>& instances) {
  views_.add(id, maker_.make(timestamp, color, depth, instances));
}

KeptKeyframes DenseMap::add(const std::filesystem::path& folder) {
  KeptKeyframes kept = read_keyframe_folder(folder, views_);
  const std::filesystem::path file = folder / "camera.yaml";
  const Camera camera = load_camera(file.string());
  for (const auto& [name, value] : {std::pair("fx", &Camera::fx),
                                    {"fy", &Camera::fy},
                                    {"cx", &Camera::cx},
                                    {"cy", &Camera::cy},
                                    {"depth_scale", &Camera::depth_scale}}) {
    if (camera.*value == camera_.*value) continue;
    throw UserError(
        fmt::format("'{}' is another camera than the map's: {} is {} against {}; give the folder of "
                    "keyframes that was written with this map",
                    file.string(), name, camera.*value, camera_.*value));
  }
  return kept;
}

const ViewSituation* DenseMap::in_volume(KeyframeId id) const {
  const auto it = in_volume_.find(id);
  return it == in_volume_.end() ? nullptr : &it->second.situation;
}

RangeImage DenseMap::range_image(KeyframeId id, const std::set<InstanceId>& moved) const {
  const cv::Mat depth = views_.depth(id);
  const cv::Mat left_out =
      left_out_mask(views_.labels(id), depth, views_.instances(id), moved, camera_, options_.left_out);
  return make_range_image(depth, left_out, camera_, options_.range, options_.volume.depth_sigma);
}

void DenseMap::take_in(KeyframeId id, const ViewSituation& situation) {
  const TsdfVolume::Moment since = volume_.add(range_image(id, situation.moved), situation.T_cw);
  in_volume_.emplace(id, InVolume{situation, since});
}

void DenseMap::take_out(KeyframeId id) {
  const auto it = in_volume_.find(id);
  const ViewSituation& situation = it->second.situation;
  volume_.remove(range_image(id, situation.moved), situation.T_cw, it->second.since);
  in_volume_.erase(it);
}

std::size_t DenseMap::follow(const std::map<KeyframeId, ViewSituation>& wanted, double tolerance,
                             std::size_t changes, const std::function<void()>& progress) {
  std::vector<KeyframeId> missing, out;
  for (const auto& [id, situation] : wanted) {
    if (!views_.holds(id)) continue;
    const ViewSituation* present = in_volume(id);
    if (present == nullptr) {
      missing.push_back(id);
    } else if (!(*present == situation) && (present->moved != situation.moved ||
                                            displacement(present->T_cw, situation.T_cw) >= tolerance)) {
      out.push_back(id);
    }
  }
  for (const auto& [id, view] : in_volume_) {
    if (!wanted.contains(id)) out.push_back(id);
  }
  missing.resize(std::min(missing.size(), changes));
  out.resize(std::min(out.size(), changes - missing.size()));
  const std::size_t done = missing.size() + out.size();

  // To take most of it out costs more than to begin anew.
  if (2 * out.size() > in_volume_.size()) {
    out.clear();
    for (const auto& [id, view] : in_volume_) out.push_back(id);
    in_volume_.clear();
    volume_ = TsdfVolume(camera_, options_.volume);
    ++rebuilds_;
  } else {
    for (const KeyframeId id : out) take_out(id);
  }
  missing.insert(missing.end(), out.begin(), out.end());
  std::sort(missing.begin(), missing.end());
  for (const KeyframeId id : missing) {
    if (const auto it = wanted.find(id); it != wanted.end()) take_in(id, it->second);
    call(progress);
  }
  return done;
}

DenseMap::Result DenseMap::cloud(const std::function<void()>& progress) {
  for (auto& [id, view] : in_volume_) {
    if (!volume_.is_up_to_date(view.since)) {
      view.since = volume_.catch_up(range_image(id, view.situation.moved), view.situation.T_cw, view.since);
    }
    call(progress);
  }
  CloudPainter painter(extract_surface(volume_.grid(), options_.volume.truncation, options_.surface), camera_,
                       options_.paint);
  for (const auto& [id, view] : in_volume_) {
    const cv::Mat color = views_.color(id), labels = views_.labels(id);
    const RangeImage range = range_image(id, view.situation.moved);
    painter.add({.color = color, .depth = range.depth, .labels = labels, .instances = views_.instances(id)},
                view.situation.T_cw);
    call(progress);
  }
  return {painter.cloud(), painter.objects()};
}

TriangleMesh DenseMap::mesh(const SemanticCloud& cloud) const {
  TriangleMesh mesh = extract_mesh(volume_.grid(), options_.volume.truncation, options_.surface);
  color_mesh(mesh, cloud, options_.volume.voxel);
  return mesh;
}

}  // namespace ipl_slam
