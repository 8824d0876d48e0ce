#include "common/progress.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/log.hpp"

namespace ipl_slam {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Output {
 public:
  Output() : file_(std::tmpfile()) {}
  ~Output() { std::fclose(file_); }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  std::FILE* stream() { return file_; }
  std::string text() {
    std::string text(static_cast<std::size_t>(std::ftell(file_)), '\0');
    std::rewind(file_);
    text.resize(std::fread(text.data(), 1, text.size(), file_));
    return text;
  }

 private:
  std::FILE* file_;
};

ProgressState tracking(std::size_t done, std::size_t total, double elapsed_s) {
  return {.label = "tracking",
          .unit = "frames",
          .done = done,
          .total = total,
          .elapsed_s = elapsed_s,
          .note = {}};
}

TEST(ProgressText, TellsCountSpeedAndTimeLeft) {
  // 120 frames in 3.5 s are 34.3 a second; the 480 that are left take 14 s.
  EXPECT_EQ(progress_text(tracking(120, 600, 3.5)), "tracking 120/600 frames, 34.3 frames/s, ETA 14 s");
}

TEST(ProgressText, HasNoTimeLeftWithoutTotalOrAtTheEnd) {
  EXPECT_EQ(progress_text(tracking(120, 0, 4.0)), "tracking 120 frames, 30.0 frames/s");
  EXPECT_EQ(progress_text(tracking(600, 600, 20.0)), "tracking 600/600 frames, 30.0 frames/s");
}

TEST(ProgressText, SaysNothingItDoesNotKnow) {
  EXPECT_EQ(progress_text(tracking(0, 600, 0.0)), "tracking 0/600 frames");
}

TEST(ProgressText, EndsWithTheNote) {
  ProgressState state = tracking(600, 600, 20.0);
  state.note = "lost 3";
  EXPECT_THAT(progress_text(state), EndsWith(", lost 3"));
}

TEST(ProgressLine, NeverExceedsItsWidth) {
  for (std::size_t width = 1; width < 200; ++width) {
    EXPECT_LE(progress_line(tracking(120, 600, 3.5), width).size(), width);
  }
}

TEST(ProgressLine, FillsTheBarInProportion) {
  const std::string line = progress_line(tracking(300, 600, 10.0), 200);
  EXPECT_EQ(std::count(line.begin(), line.end(), '#'), 20) << "half of the 40 characters";
  EXPECT_THAT(progress_line(tracking(600, 600, 10.0), 200), HasSubstr("[" + std::string(40, '#') + "]"));
  EXPECT_THAT(progress_line(tracking(700, 600, 10.0), 200), HasSubstr("[" + std::string(40, '#') + "]"));
}

TEST(ProgressLine, LeavesTheBarOutOnANarrowTerminal) {
  EXPECT_EQ(progress_line(tracking(120, 600, 3.5), 25), "tracking 120/600 frames, ");
}

TEST(Duration, IsGivenInTheUnitsOneWouldUse) {
  EXPECT_EQ(format_duration(9.4), "9 s");
  EXPECT_EQ(format_duration(187.0), "3 min 07 s");
  EXPECT_EQ(format_duration(7500.0), "2 h 05 min");
  EXPECT_EQ(format_duration(-1.0), "0 s");
}

TEST(ProgressBarOffTerminal, PrintsOnePlainLinePerTenth) {
  Output output;
  {
    ProgressBar bar("tracking", 600, "frames", output.stream(), 0);
    for (int i = 0; i < 600; ++i) bar.advance();
  }
  const std::string text = output.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10);
  EXPECT_THAT(text, StartsWith("tracking 60/600 frames"));
  EXPECT_THAT(text, HasSubstr("\ntracking 600/600 frames"));
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(ProgressBarOffTerminal, TellsHowFarItCameWhenItEndsEarly) {
  Output output;
  {
    ProgressBar bar("tracking", 600, "frames", output.stream(), 0);
    for (int i = 0; i < 65; ++i) bar.advance();
  }
  EXPECT_THAT(output.text(), HasSubstr("\ntracking 65/600 frames"));
}

TEST(ProgressBarOffTerminal, StaysSparseWithoutTotal) {
  Output output;
  ProgressBar bar("reading", 0, "frames", output.stream(), 0);
  for (int i = 0; i < 1000; ++i) bar.advance();
  bar.finish();
  const std::string text = output.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5) << "at 100, 200, 400, 800 and the end";
}

TEST(ProgressBarOffTerminal, CopesWithBigSteps) {
  Output output;
  ProgressBar bar("reading", 5, "files", output.stream(), 0);
  bar.advance(4);
  bar.advance(1);
  bar.finish();
  const std::string text = output.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
}

TEST(ProgressBarOnTerminal, RedrawsOneLineAndEndsIt) {
  Output output;
  {
    ProgressBar bar("tracking", 10000, "frames", output.stream(), 60);
    for (int i = 0; i < 10000; ++i) bar.advance();
  }
  const std::string text = output.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  EXPECT_THAT(text, EndsWith("\n"));
  EXPECT_THAT(text, HasSubstr("10000/10000 frames"));
  // Throttled: far fewer redraws than steps, however slow the machine is.
  EXPECT_LT(std::count(text.begin(), text.end(), '\r'), 5000);
}

TEST(ProgressBarOnTerminal, MakesRoomForALogLine) {
  Output output;
  ProgressBar bar("tracking", 10, "frames", output.stream(), 60);
  bar.advance();
  ::testing::internal::CaptureStderr();
  log().warn("{} is dark", "a.png");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "warning: a.png is dark\n");
  EXPECT_THAT(output.text(), EndsWith("\r\x1b[K"));
}

}  // namespace
}  // namespace ipl_slam
