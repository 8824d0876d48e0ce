#include "pipeline/sequence_run.hpp"

#include <algorithm>
#include <map>

#include "common/stopwatch.hpp"

namespace ipl_slam {

std::size_t SequenceRun::count(TrackingState state) const {
  return static_cast<std::size_t>(std::count_if(
      frames.begin(), frames.end(), [&](const FrameRecord& f) { return f.result.state == state; }));
}

SequenceRun run_sequence(RgbdSource& source, Pipeline& pipeline, const RunHooks& hooks,
                         std::size_t max_items) {
  const auto stop = [&] { return hooks.stop && hooks.stop(); };
  SequenceRun run;
  const Stopwatch total;
  for (std::size_t index = 0; max_items == 0 || index < max_items; ++index) {
    if (stop()) break;
    const Stopwatch waiting;
    std::optional<SourceItem> item = source.next();
    const double load = waiting.milliseconds();
    if (!item) break;
    if (item->frame) {
      run.frames.push_back({item->frame->index, item->timestamp, pipeline.process(*item->frame), load});
      if (hooks.frame_done) hooks.frame_done(*item->frame);
    } else {
      run.skipped.push_back({index, item->timestamp, item->skip_reason, item->detail});
    }
    if (hooks.item_taken) hooks.item_taken(run);
  }
  run.interrupted = stop();  // also where that is why the source ended
  pipeline.finish();
  run.seconds = total.milliseconds() / 1000.0;

  pipeline.mapping().read([&](const Map&, const std::vector<MappingRecord>& times) {
    std::map<std::size_t, MappingRecord> by_frame;
    for (const MappingRecord& t : times) by_frame[t.frame_index] = t;
    for (FrameRecord& f : run.frames) {
      const auto it = by_frame.find(f.index);
      if (it == by_frame.end()) continue;
      f.lines = it->second.lines;
      f.mapping = it->second.mapping;
      for (const auto& [region, gone] : it->second.removed) {
        for (InstanceRecord& i : f.result.instances) {
          if (i.id == region) i.removed = gone;
        }
      }
    }
  });
  return run;
}

}  // namespace ipl_slam
