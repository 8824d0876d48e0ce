#include <gtest/gtest.h>
#include <malloc.h>

#include "common/process_info.hpp"
#include "pipeline/pipeline.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

// What the process really uses: memory that was freed is given back first.
double used_mebibytes() {
  ::malloc_trim(0);
  return static_cast<double>(process_memory().current) / (1 << 20);
}

TEST(Memory, StaysFlatWhileTheCameraLooksAroundInAClosedRoom) {
  // Forth and back over the same frames, so that nothing new comes into view after the first 120.
  std::vector<RgbdFrame> frames = testing::render_all(testing::small_room(60, "orbit"));
  const auto period = 2 * (frames.size() - 1);
  Pipeline pipeline(testing::small_camera(), {});
  double at_500 = 0.0;
  std::size_t tracked = 0;
  for (std::size_t i = 0; i < 2000; ++i) {
    const std::size_t phase = i % period;
    RgbdFrame frame = frames[phase < frames.size() ? phase : period - phase];
    frame.index = i;
    frame.timestamp = static_cast<double>(i) / 30.0;
    tracked += pipeline.process(frame).state == TrackingState::kTracking ? 1 : 0;
    if (i == 500) at_500 = used_mebibytes();
  }
  EXPECT_EQ(tracked, 2000U);
  const double at_end = used_mebibytes();
  RecordProperty("mebibytes_at_500", std::to_string(at_500));
  RecordProperty("mebibytes_at_end", std::to_string(at_end));
  std::printf("memory %.1f MiB at frame 500, %.1f MiB at frame 2000, %zu keyframes\n", at_500, at_end,
              pipeline.keyframe_trajectory().size());
  EXPECT_LE(at_end, 1.5 * at_500);
}

}  // namespace
}  // namespace ipl_slam
