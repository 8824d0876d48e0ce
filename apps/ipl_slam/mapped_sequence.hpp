#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "dataset/prefetching_source.hpp"
#include "dataset/tum_dataset.hpp"
#include "evaluation/view_overlap.hpp"
#include "loop/loop_closer.hpp"
#include "pipeline/pipeline.hpp"

namespace ipl_slam::cli {

/// Poses at the times of the frames, where there is one.
class TruePoses {
 public:
  explicit TruePoses(Trajectory truth) : truth_(std::move(truth)) {}

  /// Camera-to-world; nothing where no pose is within kAssociationWindow.
  [[nodiscard]] std::optional<SE3> at(double timestamp) const;

 private:
  Trajectory truth_;
};

/// What walks off by itself, and what a segmenter without classes took for something that moves.
[[nodiscard]] bool may_walk_off(const Instance& instance);

/// The map that the system makes of a sequence, up to any moment of it, without recognising places: what it
/// would ask when it comes back to one.
class MappedSequence {
 public:
  /// The truth must outlive it.
  MappedSequence(const Camera& camera, const Config& config, std::unique_ptr<RgbdSource> source,
                 const TruePoses& truth);

  /// Maps what was taken before `timestamp`.
  void advance(double timestamp);
  /// Calls fn(map).
  void read(const std::function<void(const Map&)>& fn) const;
  /// What a keyframe saw, from its true pose; null where that is unknown.
  [[nodiscard]] const DepthView* seen_by(const Keyframe& keyframe) const;
  /// Where the view is by the decision of the whole: candidates verified and compared with each other.
  [[nodiscard]] std::optional<PlaceMatch> find(const PlaceView& view);

 private:
  void process(const RgbdFrame& frame);

  Camera camera_;
  Pipeline pipeline_;
  LoopCloser closer_;
  PrefetchingSource source_;
  std::optional<SourceItem> next_;
  const TruePoses& truth_;
  std::map<std::size_t, DepthView> seen_;  // by frame index
};

}  // namespace ipl_slam::cli
