#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dataset/rgbd_frame.hpp"
#include "pipeline/pipeline.hpp"

namespace ipl_slam {

/// What is remembered of a frame that was processed. Times in milliseconds.
struct FrameRecord {
  std::size_t index = 0;
  double timestamp = 0.0;
  FrameResult result;
  double load = 0.0;     ///< waiting for the images
  double lines = 0.0;    ///< extraction of its lines as a keyframe
  double mapping = 0.0;  ///< the mapper's work on this frame as a keyframe; 0 = no keyframe
};

/// A frame that was not processed.
struct SkippedFrame {
  std::size_t index = 0;
  double timestamp = 0.0;
  std::string reason, detail;
};

/// What happened to a sequence.
struct SequenceRun {
  std::vector<FrameRecord> frames;
  std::vector<SkippedFrame> skipped;
  bool interrupted = false;
  double seconds = 0.0;  ///< wall-clock time of the whole run

  [[nodiscard]] std::size_t count(TrackingState state) const;
};

/// What a caller may want to do while a sequence runs; each may be left out.
struct RunHooks {
  std::function<bool()> stop;                          ///< true ends the run, as an interruption
  std::function<void(const RgbdFrame&)> frame_done;    ///< after each frame that was processed
  std::function<void(const SequenceRun&)> item_taken;  ///< after each frame, processed or skipped
};

/// Feeds a source to the pipeline until its end, until `max_items` were taken (0 = all) or until it is
/// stopped; then waits for what is under way.
[[nodiscard]] SequenceRun run_sequence(RgbdSource& source, Pipeline& pipeline, const RunHooks& hooks = {},
                                       std::size_t max_items = 0);

}  // namespace ipl_slam
