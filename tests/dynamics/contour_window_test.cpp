#include "dynamics/contour_window.hpp"

#include <algorithm>
#include <stdexcept>

#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "dynamics/billboards.hpp"

namespace ipl_slam {
namespace {

using test::Billboard;
using test::camera_pose;
using test::kBillboardCamera;
using test::look_at_billboards;

const Billboard kSeated{0, -0.3, 0.0, 3.0};

// 3 cm a frame, 0.9 m/s at 30 frames a second.
Billboard walker(std::size_t frame, std::uint32_t id = 1) {
  return {id, -1.2 + 0.03 * static_cast<double>(frame), 0.0, 2.5};
}

SE3 swaying_camera(std::size_t frame) {
  return camera_pose(0.015 * static_cast<double>(frame));
}

ContourFrame frame_of(std::size_t index, const std::vector<Billboard>& boards, const SE3& T_wc = {}) {
  const test::BillboardView view = look_at_billboards(boards, T_wc);
  return {index, view.instances, view.depth, T_wc};
}

MotionState state_of(const ContourVerdicts& verdicts, std::uint32_t id) {
  for (const ContourVerdict& verdict : verdicts.verdicts) {
    if (verdict.id == InstanceId{id}) return verdict.state;
  }
  ADD_FAILURE() << "no verdict on " << id;
  return MotionState::kCandidate;
}

TEST(ContourWindow, JudgesTheWalkerButNotTheSeatedFromAMovingCamera) {
  ContourWindow window(kBillboardCamera, {});
  for (std::size_t i = 0; i < 50; ++i) {
    const ContourVerdicts verdicts = window.process(frame_of(i, {kSeated, walker(i)}, swaying_camera(i)));
    EXPECT_NE(state_of(verdicts, 0), MotionState::kMoving) << i;
    if (i < 10) {
      EXPECT_EQ(state_of(verdicts, 1), MotionState::kCandidate) << "there are no pairs yet";
    }
    if (i >= 20) {
      EXPECT_EQ(state_of(verdicts, 0), MotionState::kStill) << i;
      EXPECT_EQ(state_of(verdicts, 1), MotionState::kMoving) << i;
    }
  }
}

TEST(ContourWindow, OfThePaperTakesTheCamerasMotionForTheObjects) {
  ContourWindow moving_camera(kBillboardCamera, paper_contour_window());
  ContourWindow still_camera(kBillboardCamera, paper_contour_window());
  ContourVerdicts moving, still;
  for (std::size_t i = 0; i < 25; ++i) {
    moving = moving_camera.process(frame_of(i, {kSeated}, swaying_camera(i)));
    still = still_camera.process(frame_of(i, {kSeated}));
  }
  EXPECT_EQ(state_of(moving, 0), MotionState::kMoving);
  EXPECT_EQ(state_of(still, 0), MotionState::kStill);
  EXPECT_DOUBLE_EQ(*still.verdicts[0].similarity, 1.0);
}

TEST(ContourWindow, MarksAllMasksOfTheWindowOnceMotionIsFound) {
  ContourWindowOptions options;
  options.record_table = false;
  ContourWindow window(kBillboardCamera, options);
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < 45; ++i) {
    // It appears in frame 3.
    const auto boards = i < 3 ? std::vector<Billboard>{} : std::vector<Billboard>{walker(i)};
    const ContourVerdicts verdicts = window.process(frame_of(i, boards));
    if (verdicts.dynamic.empty()) {
      EXPECT_FALSE(found) << "the walker never stops";
      continue;
    }
    ASSERT_EQ(verdicts.dynamic.size(), 1U);
    EXPECT_EQ(verdicts.dynamic[0].id, InstanceId{1});
    EXPECT_EQ(verdicts.dynamic[0].first, i < 23 ? 3U : i - 20);
    EXPECT_EQ(verdicts.dynamic[0].last, i);
    if (!found) found = i;
  }
  ASSERT_TRUE(found);
  EXPECT_LE(*found, 3U + 20U);
}

TEST(ContourWindow, IsNotMisledByOneBadMask) {
  for (std::size_t bad = 0; bad < 25; bad += 3) {
    ContourWindow window(kBillboardCamera, {});
    for (std::size_t i = 0; i < 45; ++i) {
      ContourFrame frame = frame_of(i, {kSeated}, swaying_camera(i));
      if (i == bad) {  // the mask of something else
        frame.instances[0].instance.mask =
            frame_of(i, {walker(0, 0)}, swaying_camera(i)).instances[0].instance.mask;
      }
      EXPECT_NE(state_of(window.process(frame), 0), MotionState::kMoving) << "bad mask in frame " << bad;
    }
  }
}

TEST(ContourWindow, LeavesTheSeatedAloneWhenSomebodyPassesBeforeHim) {
  ContourWindow window(kBillboardCamera, {});
  for (std::size_t i = 0; i < 80; ++i) {
    Billboard passer_by = walker(i);
    passer_by.z = 1.5;
    const ContourVerdicts verdicts = window.process(frame_of(i, {kSeated, passer_by}));
    EXPECT_NE(state_of(verdicts, 0), MotionState::kMoving) << i;
  }
}

// Masks in every `step`-th frame only; what the others have is carried there. The walker stays in view, apart
// from the seated, for 65 frames.
ContourFrame sparse_frame(std::size_t i, std::size_t step) {
  const auto time = static_cast<double>(i);
  const Billboard seated{0, 1.2, 0.0, 3.0}, slow_walker{1, -1.0 + 0.025 * time, 0.0, 2.5};
  ContourFrame frame = frame_of(i, {seated, slow_walker}, camera_pose(0.005 * time));
  for (TrackedInstance& tracked : frame.instances) {
    tracked.frames_carried = static_cast<int>(i % step);
    // A carried mask is no evidence, whatever it says.
    if (tracked.frames_carried != 0) tracked.instance.mask = BitMask(frame.depth.size());
  }
  return frame;
}

TEST(ContourWindow, JudgesAlsoWhereOnlySomeFramesHaveMasks) {
  for (const std::size_t step : {3U, 5U, 8U, 10U, 11U, 12U, 15U, 20U, 30U}) {
    ContourWindow window(kBillboardCamera, {});
    // From three masks on there are three comparisons; dense ones wait for the window to fill.
    const std::size_t judged = std::max<std::size_t>(20 + step, 2 * step);
    for (std::size_t i = 0; i <= 65; ++i) {
      const ContourVerdicts verdicts = window.process(sparse_frame(i, step));
      EXPECT_NE(state_of(verdicts, 0), MotionState::kMoving) << "masks every " << step << ", frame " << i;
      if (i < judged) continue;
      EXPECT_EQ(state_of(verdicts, 0), MotionState::kStill) << "masks every " << step << ", frame " << i;
      EXPECT_EQ(state_of(verdicts, 1), MotionState::kMoving) << "masks every " << step << ", frame " << i;
    }
  }
}

// A slow segmenter in realtime: the frames between are not given at all.
TEST(ContourWindow, JudgesAlsoWhereFramesAreFarApart) {
  for (const std::size_t step : {12U, 15U, 25U, 30U}) {
    ContourWindow window(kBillboardCamera, {});
    ContourVerdicts verdicts;
    for (std::size_t i = 0; i <= 2 * step; i += step) verdicts = window.process(sparse_frame(i, step));
    EXPECT_EQ(state_of(verdicts, 0), MotionState::kStill) << "frames every " << step;
    EXPECT_EQ(state_of(verdicts, 1), MotionState::kMoving) << "frames every " << step;
    ASSERT_EQ(verdicts.dynamic.size(), 1U);
    EXPECT_EQ(verdicts.dynamic[0].first, 0U) << "all masks that were compared are marked";
  }
}

TEST(ContourWindow, IsNotMisledByOneBadMaskWhereMasksAreRare) {
  for (const std::size_t step : {12U, 15U, 30U}) {
    for (std::size_t bad = 0; bad < 5 * step; bad += step) {
      ContourWindow window(kBillboardCamera, {});
      for (std::size_t i = 0; i < 5 * step; i += step) {
        ContourFrame frame = frame_of(i, {kSeated});
        if (i == bad) {  // the mask of something else
          frame.instances[0].instance.mask = frame_of(i, {walker(0, 0)}).instances[0].instance.mask;
        }
        EXPECT_NE(state_of(window.process(frame), 0), MotionState::kMoving)
            << "masks every " << step << ", the one of frame " << bad << " bad";
      }
    }
  }
}

TEST(ContourWindow, JudgesNothingBeyondTheSparseWindow) {
  ContourWindow window(kBillboardCamera, {});
  for (std::size_t i = 0; i <= 200; i += 40) {
    EXPECT_EQ(state_of(window.process(frame_of(i, {kSeated})), 0), MotionState::kCandidate);
  }
}

// Who was away is not compared with how he was seen before.
TEST(ContourWindow, StartsAnewAfterAnAbsence) {
  ContourWindow window(kBillboardCamera, {});
  const Billboard other{7, 1.0, 0.0, 3.0};
  for (std::size_t i = 0; i < 70; ++i) {
    const bool away = i >= 25 && i < 50;
    Billboard chair = kSeated;
    if (i >= 50) chair.x += 1.0;
    const ContourVerdicts verdicts =
        window.process(frame_of(i, away ? std::vector{other} : std::vector{chair, other}));
    if (!away) {
      EXPECT_NE(state_of(verdicts, 0), MotionState::kMoving) << i;
    }
    if (i == 50) {
      EXPECT_EQ(state_of(verdicts, 0), MotionState::kCandidate);
    }
  }
}

TEST(ContourWindow, OfThePaperComparesMasksExactlyTenFramesApart) {
  for (const std::size_t step : {1U, 5U, 10U}) {
    ContourWindow window(kBillboardCamera, paper_contour_window());
    ContourVerdicts verdicts;
    for (std::size_t i = 0; i <= 30; i += step) verdicts = window.process(frame_of(i, {kSeated}));
    EXPECT_EQ(state_of(verdicts, 0), MotionState::kStill) << "masks every " << step;
  }
  ContourWindow window(kBillboardCamera, paper_contour_window());
  for (std::size_t i = 0; i <= 60; i += 9) {
    EXPECT_EQ(state_of(window.process(frame_of(i, {kSeated})), 0), MotionState::kCandidate);
  }
}

TEST(ContourWindow, RefusesOptionsWithWhichNothingCouldBeJudged) {
  EXPECT_NO_THROW(check(ContourWindowOptions{}));
  EXPECT_NO_THROW(check(paper_contour_window()));
  ContourWindowOptions options;
  options.pair_gap = 21;
  EXPECT_THROW(check(options), UserError);
  options.pair_gap = 10;
  options.minimum_pairs = 12;  // the 11 from frames 10 to 20, and first with last
  EXPECT_NO_THROW(check(options));
  options.minimum_pairs = 13;
  EXPECT_THROW(check(options), UserError);
}

TEST(ContourWindow, HasNoOpinionWhileTheCameraIsLost) {
  ContourWindow window(kBillboardCamera, {});
  for (std::size_t i = 0; i < 30; ++i) {
    ContourFrame frame = frame_of(i, {kSeated, walker(i)}, swaying_camera(i));
    frame.T_wc.reset();
    const ContourVerdicts verdicts = window.process(frame);
    EXPECT_EQ(state_of(verdicts, 0), MotionState::kCandidate);
    EXPECT_EQ(state_of(verdicts, 1), MotionState::kCandidate);
  }
}

class KnownMover : public testing::Test {
 protected:
  // Someone walks during frames 0 .. 29.
  void walk(ContourWindow& window) {
    for (std::size_t i = 0; i < 30; ++i) last_ = window.process(frame_of(i, {walker(i)}));
    ASSERT_EQ(state_of(last_, 1), MotionState::kMoving);
  }
  ContourVerdicts last_;
};

TEST_F(KnownMover, IsMovingAtOnceWhenItComesBack) {
  ContourWindow window(kBillboardCamera, {});
  walk(window);
  last_ = window.process(frame_of(200, {walker(0)}));
  EXPECT_EQ(state_of(last_, 1), MotionState::kMoving);
  ASSERT_EQ(last_.dynamic.size(), 1U);
  EXPECT_EQ(last_.dynamic[0].first, 200U);
  EXPECT_EQ(last_.dynamic[0].last, 200U);
}

TEST_F(KnownMover, IsACandidateAgainWithoutTheRecordTable) {
  ContourWindowOptions options;
  options.record_table = false;
  ContourWindow window(kBillboardCamera, options);
  walk(window);
  last_ = window.process(frame_of(200, {walker(0)}));
  EXPECT_EQ(state_of(last_, 1), MotionState::kCandidate);
}

TEST_F(KnownMover, IsForgottenWhenItWasAwayForLong) {
  ContourWindow window(kBillboardCamera, {});
  walk(window);
  last_ = window.process(frame_of(29 + 301, {walker(0)}));
  EXPECT_EQ(state_of(last_, 1), MotionState::kCandidate);
}

TEST_F(KnownMover, IsStillAgainWhenItHasStoodForAWindow) {
  ContourWindow window(kBillboardCamera, {});
  walk(window);
  std::optional<std::size_t> still_from;
  for (std::size_t i = 30; i < 90; ++i) {
    last_ = window.process(frame_of(i, {walker(30)}, swaying_camera(i - 30)));
    const bool still = state_of(last_, 1) == MotionState::kStill;
    if (still && !still_from) still_from = i;
    if (still_from) {
      EXPECT_TRUE(still) << "nothing moves any more in frame " << i;
    }
  }
  ASSERT_TRUE(still_from);
  // It still moved a little in the pairs that reach back before frame 30, and checks come every 10 frames.
  EXPECT_GE(*still_from, 30U + 15U);
  EXPECT_LE(*still_from, 30U + 40U);
}

TEST(ContourWindow, AsksMoreOfThingsThatDoNotMoveByThemselves) {
  ContourWindowOptions options;
  for (const char* name : {"person", "chair"}) {
    ContourWindow window(kBillboardCamera, options);
    ContourVerdicts verdicts;
    for (std::size_t i = 0; i < 30; ++i) {
      // 1.6 cm a frame of 60 cm: IoU over 10 frames = 44 / 76 = 0.58
      Billboard board{0, 0.016 * static_cast<double>(i), 0.0, 3.0};
      board.class_name = name;
      verdicts = window.process(frame_of(i, {board}));
    }
    EXPECT_NEAR(*verdicts.verdicts[0].similarity, 0.58, 0.04);
    EXPECT_EQ(state_of(verdicts, 0),
              std::string(name) == "person" ? MotionState::kMoving : MotionState::kStill);
  }
}

TEST(ContourWindow, WantsFramesInOrder) {
  ContourWindow window(kBillboardCamera, {});
  static_cast<void>(window.process(frame_of(5, {kSeated})));
  EXPECT_THROW(static_cast<void>(window.process(frame_of(5, {kSeated}))), std::invalid_argument);
}

TEST(ContourWindow, SettingsOfBothPresetsAreInRange) {
  EXPECT_NO_THROW(check_options(ContourWindowOptions{}));
  EXPECT_NO_THROW(check_options(paper_contour_window()));
}

}  // namespace
}  // namespace ipl_slam
