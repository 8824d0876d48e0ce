#include <csignal>
#include <cstdlib>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/interrupt.hpp"
#include "common/log.hpp"
#include "common/process_info.hpp"

namespace ipl_slam {
namespace {

// Signals end or mark the whole process, so each of these runs in one of its own.
TEST(InterruptDeathTest, FirstCtrlCOnlyRaisesTheFlag) {
  EXPECT_EXIT(
      {
        install_interrupt_handler();
        if (interrupted()) std::_Exit(1);
        std::raise(SIGINT);
        std::_Exit(interrupted() ? 0 : 2);
      },
      ::testing::ExitedWithCode(0), "");
}

TEST(InterruptDeathTest, SecondCtrlCEndsTheProcess) {
  EXPECT_EXIT(
      {
        install_interrupt_handler();
        std::raise(SIGINT);
        std::raise(SIGINT);
        std::_Exit(0);
      },
      ::testing::KilledBySignal(SIGINT), "");
}

TEST(ProcessMemory, PeakIsAtLeastWhatIsUsedAndSeesABigAllocation) {
  const ProcessMemory before = process_memory();
  ASSERT_GT(before.current, 0U);
  EXPECT_GE(before.peak, before.current);
  constexpr std::size_t kBytes = 64U << 20;
  { const std::vector<char> block(kBytes, 1); }
  // The block is written in full, so all of it was resident; what was free before it may have been used for a
  // part.
  EXPECT_GE(process_memory().peak, before.current + kBytes / 2);
}

TEST(Log, LetsThroughWhatTheLevelSays) {
  const auto said_at = [](LogLevel level) {
    set_log_level(level);
    ::testing::internal::CaptureStderr();
    log().debug("d");
    log().info("i");
    log().warn("w");
    log().error("e");
    set_log_level(LogLevel::kNormal);
    return ::testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(said_at(LogLevel::kQuiet), "error: e\n");
  EXPECT_EQ(said_at(LogLevel::kNormal), "i\nwarning: w\nerror: e\n");
  EXPECT_EQ(said_at(LogLevel::kVerbose), "debug: d\ni\nwarning: w\nerror: e\n");
}

}  // namespace
}  // namespace ipl_slam
