#include "segmentation/instance_tracker.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "segmentation/drawn_scene.hpp"

namespace ipl_slam {
namespace {

using test::draw;
using test::DrawnFrame;
using test::Figure;

constexpr int kAll = -1;

/// A tracker in a drawn scene, frame after frame.
class TrackerTest : public ::testing::Test {
 protected:
  /// The next frame, in which the segmenter finds all figures that show, or all but the one left out.
  std::vector<TrackedInstance> see(const std::vector<Figure>& figures, int left_out = kAll) {
    frame_ = draw(index_++, figures);
    std::vector<Instance> found;
    for (std::size_t i = 0; i < figures.size(); ++i) {
      // A segmenter does not find a sliver.
      if (static_cast<int>(i) != left_out && frame_.instances[i].mask.area() > 300)
        found.push_back(frame_.instances[i]);
    }
    return tracker_.update(tracker_.view(frame_.rgbd), found);
  }
  std::vector<TrackedInstance> see_with(const std::vector<Figure>& figures,
                                        const std::vector<Instance>& found) {
    frame_ = draw(index_++, figures);
    return tracker_.update(tracker_.view(frame_.rgbd), found);
  }
  /// The next frame, not segmented.
  std::vector<TrackedInstance> glance(const std::vector<Figure>& figures) {
    frame_ = draw(index_++, figures);
    return tracker_.carry(tracker_.view(frame_.rgbd));
  }
  /// The id under which the i-th figure of the last frame goes; invalid if none covers it.
  [[nodiscard]] InstanceId id_of(const std::vector<TrackedInstance>& tracked, std::size_t i) const {
    for (const TrackedInstance& t : tracked) {
      if (iou(t.instance.mask, frame_.instances[i].mask) > 0.5) return t.id;
    }
    return {};
  }

  InstanceTracker tracker_{test::drawn_camera()};
  DrawnFrame frame_;
  std::size_t index_ = 0;
};

const Figure kRed{.centre = {160, 120}, .depth = 2.5, .seed = 1, .color = {90, 90, 180}};
const Figure kBlue{.centre = {60, 125}, .depth = 1.5, .seed = 2, .color = {190, 100, 80}};

Figure at(Figure figure, int x) {
  figure.centre.x = x;
  return figure;
}

TEST_F(TrackerTest, WhoPassesBeforeAnotherSwapsNoIds) {
  for (int i = 0; i <= 24; ++i) {
    const auto tracked = see({at(kRed, 220 - 5 * i), at(kBlue, 60 + 8 * i)});
    EXPECT_LE(tracked.size(), 2u) << "frame " << i;
    if (frame_.instances[0].mask.area() > 2000) {
      EXPECT_EQ(id_of(tracked, 0).value, 0u) << "frame " << i;
    }
    EXPECT_EQ(id_of(tracked, 1).value, 1u) << "frame " << i;
  }
}

TEST_F(TrackerTest, ASeatedManKeepsHisIdBehindAPasser) {
  Figure wide = kBlue;
  wide.half = {45, 110};  // hides the man wholly for some frames
  int hidden = 0;
  for (int x = 20; x <= 300; x += 10) {
    const auto tracked = see({kRed, at(wide, x)});
    if (frame_.instances[0].mask.area() < 100) ++hidden;
    for (const TrackedInstance& t : tracked) EXPECT_LT(t.id.value, 2u) << "a third person at " << x;
  }
  EXPECT_GT(hidden, 1) << "the scene does not show what it is for";
  EXPECT_EQ(id_of(see({kRed}), 0).value, 0u);
}

TEST_F(TrackerTest, MissedDetectionsAreBridged) {
  for (int i = 0; i < 20; ++i) {
    const bool missed = i >= 8 && i < 13;
    const auto tracked = see({at(kRed, 80 + 6 * i)}, missed ? 0 : kAll);
    ASSERT_EQ(tracked.size(), 1u) << "frame " << i;
    EXPECT_EQ(id_of(tracked, 0).value, 0u) << "frame " << i;
    EXPECT_EQ(tracked[0].frames_carried, missed ? i - 7 : 0);
  }
}

TEST_F(TrackerTest, FramesBetweenSegmentedOnesAreBridged) {
  for (int i = 0; i < 20; ++i) {
    const std::vector<Figure> figures{at(kRed, 80 + 6 * i)};
    const auto tracked = i % 4 == 0 ? see(figures) : glance(figures);
    ASSERT_EQ(tracked.size(), 1u) << "frame " << i;
    EXPECT_GT(iou(tracked[0].instance.mask, frame_.instances[0].mask), 0.85) << "frame " << i;
    EXPECT_EQ(tracked[0].frames_carried, i % 4);
  }
}

TEST_F(TrackerTest, NoGhostStaysWhereSomebodyWas) {
  for (int i = 0; i < 5; ++i) (void)see({kRed});
  EXPECT_TRUE(see({}).empty());
}

TEST_F(TrackerTest, AMaskIsNotCarriedForEver) {
  InstanceTrackerOptions options;
  options.max_carried = 5;
  tracker_ = InstanceTracker(test::drawn_camera(), options);
  (void)see({kRed});
  for (int i = 1; i <= 7; ++i) EXPECT_EQ(glance({kRed}).size(), i <= 5 ? 1u : 0u) << "frame " << i;
}

TEST_F(TrackerTest, WhatWasSeenOnceOnlyIsGivenUpSoon) {
  (void)see({kRed});
  EXPECT_EQ(see({kRed}, 0).size(), 1u);
  EXPECT_TRUE(see({kRed}, 0).empty());
}

TEST_F(TrackerTest, WhoComesBackIsRecognised) {
  for (int i = 0; i < 14; ++i) (void)see({at(kRed, 60 - 8 * i), at(kBlue, 220)});
  EXPECT_TRUE(frame_.instances[0].mask.none()) << "the scene does not show what it is for";
  for (int i = 0; i < 14; ++i) {
    const auto tracked = see({at(kRed, -44 + 8 * i), at(kBlue, 220)});
    if (frame_.instances[0].mask.area() > 2000) {
      EXPECT_EQ(id_of(tracked, 0).value, 0u) << "frame " << i;
    }
  }
}

TEST_F(TrackerTest, SomebodyElseIsNotTakenForWhoLeft) {
  for (int i = 0; i < 5; ++i) (void)see({kRed});
  (void)see({});
  Figure other = kRed;
  other.color = {80, 190, 90};
  const auto tracked = see({other});
  ASSERT_EQ(tracked.size(), 1u);
  EXPECT_EQ(tracked[0].id.value, 1u);
}

TEST_F(TrackerTest, AClassFlipBreaksNoIdAndTheMajorityNamesIt) {
  Figure seat = kRed;
  for (int i = 0; i < 6; ++i) {
    seat.class_name = i == 3 ? "couch" : "chair";
    const auto tracked = see({seat});
    ASSERT_EQ(tracked.size(), 1u);
    EXPECT_EQ(tracked[0].id.value, 0u);
    EXPECT_EQ(tracked[0].instance.class_name, "chair");
  }
}

TEST_F(TrackerTest, WhoSitsDownOnAChairDoesNotBecomeIt) {
  Figure seat = kRed;
  seat.class_name = "chair";
  for (int i = 0; i < 3; ++i) (void)see({seat});
  const auto tracked = see({kRed});  // all that is detected now is a person in its place
  EXPECT_EQ(tracked.back().instance.class_name, "person");
  EXPECT_EQ(tracked.back().id.value, 1u);
}

TEST_F(TrackerTest, APersonInTwoBoxesIsOne) {
  for (int i = 0; i < 4; ++i) (void)see({kRed});
  const Instance whole = frame_.instances[0];
  cv::Mat upper = whole.mask.to_image(), lower = upper.clone();
  upper.rowRange(110, 240) = 0;
  lower.rowRange(0, 110) = 0;
  std::vector<Instance> halves{whole, whole};
  halves[0].mask = BitMask::from_image(upper);
  halves[1].mask = BitMask::from_image(lower);
  const auto tracked = see_with({kRed}, halves);
  ASSERT_EQ(tracked.size(), 1u);
  EXPECT_EQ(tracked[0].id.value, 0u);
  EXPECT_EQ(tracked[0].instance.mask, whole.mask);
}

TEST_F(TrackerTest, APersonFoundTwiceIsOne) {
  const DrawnFrame frame = draw(0, {kRed});
  Instance again = frame.instances[0];
  cv::Mat smaller = again.mask.to_image();
  smaller.rowRange(0, 70) = 0;
  again.mask = BitMask::from_image(smaller);
  again.score = 0.4F;
  EXPECT_EQ(see_with({kRed}, {again, frame.instances[0]}).size(), 1u);
}

TEST_F(TrackerTest, TwoPeopleInOneDetectionStayTwo) {
  for (int i = 0; i < 5; ++i) (void)see({at(kRed, 180), at(kBlue, 100 + 4 * i)});
  const std::vector<Figure> figures{at(kRed, 180), at(kBlue, 122)};
  DrawnFrame frame = draw(index_, figures);
  Instance both = frame.instances[0];
  both.mask |= frame.instances[1].mask;
  const auto tracked = see_with(figures, {both});
  ASSERT_EQ(tracked.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(tracked[i].id.value, i);
    EXPECT_GT(iou(tracked[i].instance.mask, frame_.instances[i].mask), 0.85);
  }
}

TEST_F(TrackerTest, TheRimOfACoveredDetectionIsNobody) {
  Instance rim = draw(0, {kRed}).instances[0];
  rim.score = 0.4F;
  for (int y = rim.box.y; y < rim.box.br().y; ++y) {
    for (int x = rim.box.x + 1; x < 320; ++x) rim.mask.row(y)[x / 64] &= ~(std::uint64_t{1} << (x % 64));
  }
  rim.mask.set(rim.box.br().x - 1, rim.box.br().y - 1);
  EXPECT_EQ(see_with({kRed}, {draw(0, {kRed}).instances[0], rim}).size(), 1u);
}

TEST_F(TrackerTest, ACopyGoesItsOwnWay) {
  (void)see({kRed});
  InstanceTracker copy = tracker_;
  (void)glance({at(kRed, 166)});
  const DrawnFrame next = draw(1, {at(kRed, 166), at(kBlue, 60)});
  EXPECT_EQ(copy.update(copy.view(next.rgbd), next.instances).size(), 2u);
  EXPECT_EQ(glance({at(kRed, 172)}).size(), 1u);
}

TEST_F(TrackerTest, RefusesToGoBackInTime) {
  (void)see({kRed});
  index_ = 0;
  EXPECT_THROW((void)see({kRed}), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
