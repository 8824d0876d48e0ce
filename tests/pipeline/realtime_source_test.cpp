#include "pipeline/realtime_source.hpp"

#include <atomic>
#include <chrono>
#include <set>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

using testing::KeptFrames;

std::vector<RgbdFrame> stamped(int count, double step) {
  std::vector<RgbdFrame> frames(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].index = i;
    frames[i].timestamp = 100.0 + step * static_cast<double>(i);
  }
  return frames;
}

TEST(RealtimeSource, AReaderThatKeepsUpGetsEveryFrameNotBeforeItsTime) {
  RealtimeSource source(std::make_unique<KeptFrames>(stamped(10, 0.01)), 100);
  const auto start = std::chrono::steady_clock::now();
  std::size_t count = 0;
  while (auto item = source.next()) {
    ASSERT_TRUE(item->frame);
    EXPECT_EQ(item->frame->index, count);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    EXPECT_GE(elapsed.count(), 0.0099 * static_cast<double>(count));
    ++count;
  }
  EXPECT_EQ(count, 10U);
  EXPECT_FALSE(source.next());
}

TEST(RealtimeSource, DropsTheOldestOfALateReaderAndReportsEachDropOnce) {
  constexpr int kFrames = 50;
  RealtimeSource source(std::make_unique<KeptFrames>(stamped(kFrames, 0.001)), 2);
  std::set<double> given, dropped;
  auto item = source.next();
  // All that is left is played while the reader sleeps; where a slow machine has not finished playing, more
  // frames get through, and the sums below hold all the same.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  for (; item; item = source.next()) {
    if (!item->frame) {
      EXPECT_EQ(item->skip_reason, RealtimeSource::kLate);
    }
    EXPECT_TRUE((item->frame ? given : dropped).insert(item->timestamp).second) << "given twice";
  }
  EXPECT_EQ(given.size() + dropped.size(), static_cast<std::size_t>(kFrames));
  EXPECT_GE(dropped.size(), 1U);
  EXPECT_TRUE(given.contains(100.0 + 0.001 * (kFrames - 1))) << "the newest frame is never dropped";
}

TEST(RealtimeSource, CanBeAbandonedBeforeDuringAndAfterPlaying) {
  { RealtimeSource unused(std::make_unique<KeptFrames>(stamped(3, 1000.0)), 2); }
  {
    // The second frame is due in a quarter of an hour; this test ends before.
    RealtimeSource waiting(std::make_unique<KeptFrames>(stamped(3, 1000.0)), 2);
    EXPECT_TRUE(waiting.next());
  }
  {
    RealtimeSource done(std::make_unique<KeptFrames>(stamped(3, 0.0001)), 5);
    while (done.next()) {
    }
  }
}

TEST(RealtimeSource, AStopEndsAPauseInTheRecording) {
  std::atomic<bool> stop = false;
  RealtimeSource source(std::make_unique<KeptFrames>(stamped(3, 1000.0)), 2, [&] { return stop.load(); });
  EXPECT_TRUE(source.next());
  stop = true;
  EXPECT_FALSE(source.next());
}

/// Gives one frame and then fails.
class FailingSource : public RgbdSource {
 public:
  [[nodiscard]] std::optional<SourceItem> next() override {
    if (given_) throw std::runtime_error("the cable was pulled");
    given_ = true;
    return SourceItem{RgbdFrame{}, 0.0, {}, {}};
  }
  [[nodiscard]] std::size_t size() const override { return 2; }

 private:
  bool given_ = false;
};

TEST(RealtimeSource, PassesOnTheFailureOfItsSource) {
  RealtimeSource source(std::make_unique<FailingSource>(), 2);
  EXPECT_TRUE(source.next());
  EXPECT_THROW((void)source.next(), std::runtime_error);
  EXPECT_FALSE(source.next());
}

}  // namespace
}  // namespace ipl_slam
