#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dataset/camera_config.hpp"
#include "dataset/spliced_source.hpp"
#include "dataset/trajectory.hpp"
#include "dataset/tum_dataset.hpp"
#include "pipeline/pipeline.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam::testing {

/// Images whose true poses are known, in memory.
struct KnownWalk {
  Camera camera;
  std::vector<RgbdFrame> frames;
  std::vector<SE3> T_wc;
};

inline KnownWalk rendered_walk(const SyntheticOptions& options) {
  const SyntheticSource source(options, 2);
  KnownWalk walk{source.camera(), {}, {}};
  for (std::size_t i = 0; i < source.size(); ++i) {
    SyntheticFrame frame = source.render(i);
    walk.frames.push_back(std::move(frame.rgbd));
    walk.T_wc.push_back(frame.T_wc);
  }
  return walk;
}

/// The folder of a recorded sequence below $IPL_SLAM_DATA, empty where it is absent.
inline std::filesystem::path recorded(const char* name) {
  const char* data = std::getenv("IPL_SLAM_DATA");
  const std::filesystem::path folder = std::filesystem::path(data != nullptr ? data : "") / name;
  return data != nullptr && std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

/// A trajectory's pose at a time, between the two poses around it.
inline SE3 pose_at(const Trajectory& trajectory, double time) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), time,
                                      [](const StampedPose& p, double t) { return p.timestamp < t; });
  if (after == trajectory.begin()) return trajectory.front().T_wc;
  if (after == trajectory.end()) return trajectory.back().T_wc;
  const StampedPose &a = *(after - 1), &b = *after;
  const double share = (time - a.timestamp) / (b.timestamp - a.timestamp);
  return {a.T_wc.rotation().slerp(share, b.T_wc.rotation()),
          (1.0 - share) * a.T_wc.translation() + share * b.T_wc.translation()};
}

/// The first `count` frames of a recorded sequence, all of them with 0.
inline KnownWalk recorded_walk(const std::filesystem::path& folder, std::size_t count = 0) {
  KnownWalk walk{load_camera(*guess_camera(folder)), {}, {}};
  const Trajectory truth = read_trajectory(folder / "groundtruth.txt");
  TumDataset source(folder, walk.camera);
  while (auto item = source.next()) {
    if (count > 0 && walk.frames.size() == count) break;
    if (!item->frame) continue;
    walk.T_wc.push_back(pose_at(truth, item->timestamp));
    walk.frames.push_back(std::move(*item->frame));
  }
  return walk;
}

/// The same frames as a camera smears them that is swung about: motion blur over `pixels`, sideways.
inline std::vector<RgbdFrame> smeared(std::vector<RgbdFrame> frames, int pixels) {
  for (RgbdFrame& frame : frames) {
    cv::Mat blurred;
    cv::blur(frame.color, blurred, {pixels, 5});
    frame.color = blurred;
  }
  return frames;
}

/// The same frames from the last to the first, at the same times.
inline std::vector<RgbdFrame> reversed(std::vector<RgbdFrame> frames) {
  for (std::size_t i = 0; i < frames.size() / 2; ++i) {
    RgbdFrame &a = frames[i], &b = frames[frames.size() - 1 - i];
    std::swap(a, b);
    std::swap(a.timestamp, b.timestamp);
  }
  return frames;
}

/// Frames of several sources, cut and put together anew.
inline SplicedSource splice(const std::vector<const std::vector<RgbdFrame>*>& sources,
                            const std::vector<SplicedSource::Cut>& cuts) {
  std::vector<KeptFrames> kept;
  for (const auto* frames : sources) kept.emplace_back(*frames);
  std::vector<RgbdSource*> pointers;
  for (KeptFrames& frames : kept) pointers.push_back(&frames);
  return {pointers, cuts, 1.0 / 30.0};
}

/// What a pipeline made of one frame of a spliced sequence.
struct PlacedFrame {
  SplicedSource::Origin origin;
  double timestamp = 0.0;
  bool tracked = false;
  SE3 T_wc;     // as known at that moment, where tracked
  PartId part;  // the part it was tracked in, at that moment
};

inline PartId part_of(const Pipeline& pipeline, KeyframeId keyframe) {
  PartId part;
  pipeline.mapping().read(
      [&](const Map& map, const std::vector<MappingRecord>&) { part = map.part_of(keyframe); });
  return part;
}

/// Plays all of `source`. In lockstep only: it looks into the map after each frame.
inline std::vector<PlacedFrame> play(SplicedSource& source, Pipeline& pipeline) {
  std::vector<PlacedFrame> placed;
  while (const auto item = source.next()) {
    const FrameResult result = pipeline.process(*item->frame);
    PlacedFrame frame{source.origin(item->frame->index), item->timestamp, false, result.T_wc, {}};
    frame.tracked = result.state == TrackingState::kTracking;
    if (frame.tracked) frame.part = part_of(pipeline, pipeline.last_tracked().reference);
    placed.push_back(frame);
  }
  return placed;
}

/// By how much the way from a to b was estimated wrongly, m.
inline double way_error(const SE3& T_wa, const SE3& T_wb, const SE3& true_T_wa, const SE3& true_T_wb) {
  const SE3 T_ab = T_wa.inverse() * T_wb, true_T_ab = true_T_wa.inverse() * true_T_wb;
  return (true_T_ab.inverse() * T_ab).translation().norm();
}

}  // namespace ipl_slam::testing
