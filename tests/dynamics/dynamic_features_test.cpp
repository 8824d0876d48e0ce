#include "dynamics/dynamic_features.hpp"

#include <numeric>

#include <gtest/gtest.h>

#include "dynamics/point_grid.hpp"

namespace ipl_slam {
namespace {

using namespace test;

constexpr InstanceId kFirst{3}, kSecond{5};
// Covers u = 240, 290, 340 and v = 190, 240, 290 of the grid: 9 points of 108.
const cv::Rect kBox(220, 170, 141, 141);
constexpr std::size_t kInBox = 9, kOutside = PointGrid::kSize - kInBox;

DynamicsOptions options(const std::string& rule) {
  DynamicsOptions o;
  o.rule = rule;
  o.growth = 0;
  o.region_share = 0.2;
  o.min_witnesses = 50;
  o.weights = "off";
  o.min_weight = 0.05;
  o.points.check = "depth";
  o.points.search_radius = 30.0;
  o.points.pixel_sigma = 1.0;
  o.points.inverse_depth_sigma = 0.02;
  o.points.threshold = 10.0;
  o.points.match = {.max_distance = 60, .ratio = 0.8, .max_rotation = 0.35, .inverse_depth_gate = 0.0};
  o.lines.check = "residual";
  o.belief.likely_mover = 1.0;
  o.belief.unknown = 1.0;
  o.belief.movable = -2.0;
  o.belief.background = -3.0;
  o.belief.contour = 3.0;
  o.belief.moved_on_mover = 0.5;
  o.belief.moved_on_still = 0.1;
  o.belief.frame_moving = o.belief.frame_still = 2.0;
  o.belief.memory = 0.8;
  o.belief.most_moving = 5.0;
  o.belief.most_still = 3.0;
  return o;
}

bool in_box(std::size_t k) {
  const Eigen::Vector2d uv = PointGrid::uv(k / PointGrid::kRows, k % PointGrid::kRows);
  return kBox.contains(cv::Point(static_cast<int>(uv.x()), static_cast<int>(uv.y())));
}

std::size_t sum(const std::vector<std::uint8_t>& flags) {
  return static_cast<std::size_t>(std::accumulate(flags.begin(), flags.end(), 0));
}

// One run of DynamicFeatures over a grid of points; the camera stands unless a test says otherwise.
struct Sequence {
  explicit Sequence(const DynamicsOptions& o) : dynamics(kTestCamera, kTestPyramid, o) {}

  FeatureWeights step(const std::vector<TrackedInstance>& instances, const std::optional<SE3>& T_cw = SE3()) {
    return step(grid.look(T_cw.value_or(SE3())), instances, T_cw);
  }
  FeatureWeights step(Features features, const std::vector<TrackedInstance>& instances,
                      const std::optional<SE3>& T_cw = SE3()) {
    witness = dynamics.locate(SyntheticWorld::make_frame(std::move(features), index++), instances);
    FeatureWeights weights = dynamics.decide(T_cw, [&](InstanceId) { return contour; });
    dynamics.placed(T_cw);
    return weights;
  }
  // Moves so many of the points in the box by 4 cm to the right, 7 to 11 px.
  void move_in_box(std::size_t count) {
    for (std::size_t k = 0; k < PointGrid::kSize && count > 0; ++k) {
      if (!in_box(k)) continue;
      grid.positions[k].x() += 0.04;
      --count;
    }
  }

  PointGrid grid;
  DynamicFeatures dynamics;
  MotionState contour = MotionState::kCandidate;
  std::size_t index = 0;
  std::vector<std::uint8_t> witness;
};

const TrackedInstance kPerson = box_instance(kFirst.value, "person", kBox);
const TrackedInstance kChair = box_instance(kFirst.value, "chair", kBox);
const TrackedInstance kBed = box_instance(kFirst.value, "bed", kBox);

const Region& only_region(const FeatureWeights& weights) {
  EXPECT_EQ(weights.regions->size(), 1U);
  return weights.regions->front();
}

TEST(DynamicFeatures, PointsOutsideAllThatMayMoveAreWitnesses) {
  for (const TrackedInstance& instance : {kPerson, kChair}) {
    Sequence run(options("evidence"));
    (void)run.step({instance});
    for (std::size_t k = 0; k < PointGrid::kSize; ++k) EXPECT_EQ(run.witness[k], in_box(k) ? 0 : 1);
  }
  Sequence run(options("evidence"));
  (void)run.step({kBed});
  EXPECT_EQ(sum(run.witness), PointGrid::kSize) << "a bed does not move";
  (void)run.step({});
  EXPECT_EQ(sum(run.witness), PointGrid::kSize);
}

TEST(DynamicFeatures, WithTooFewWitnessesThoseInRegionsBelievedStillAreAskedToo) {
  DynamicsOptions o = options("evidence");
  o.min_witnesses = kOutside + 1;
  Sequence with_chair(o);
  (void)with_chair.step({kChair});
  EXPECT_EQ(sum(with_chair.witness), PointGrid::kSize) << "a chair hardly ever moves";

  Sequence with_person(o);
  (void)with_person.step({kPerson});
  EXPECT_EQ(sum(with_person.witness), kOutside) << "of a person that has to be seen first";
  for (int i = 0; i < 5; ++i) (void)with_person.step({kPerson});
  EXPECT_EQ(sum(with_person.witness), PointGrid::kSize);

  o.min_witnesses = kOutside;
  Sequence enough(o);
  (void)enough.step({kChair});
  EXPECT_EQ(sum(enough.witness), kOutside);
}

TEST(DynamicFeatures, OnlyPointsWithDepthCountAsEnoughWitnesses) {
  DynamicsOptions o = options("evidence");
  o.min_witnesses = kOutside;
  Sequence run(o);
  Features features = run.grid.look();
  features.keypoints[0].depth = 0.0F;
  (void)run.step(features, {kChair});
  EXPECT_EQ(sum(run.witness), PointGrid::kSize) << "one is missing, so the chair is asked";
  EXPECT_EQ(run.witness[0], 1) << "a point without depth is a witness all the same";
}

TEST(DynamicFeatures, WithTooFewWitnessesNobodyIsRemovedForWhatHeIs) {
  DynamicsOptions o = options("evidence");
  Sequence enough(o);
  EXPECT_TRUE(only_region(enough.step({kPerson})).verdict.dynamic);
  o.min_witnesses = kOutside + 1;
  Sequence few(o);
  EXPECT_FALSE(only_region(few.step({kPerson})).verdict.dynamic);
  few.move_in_box(kInBox);
  EXPECT_TRUE(only_region(few.step({kPerson})).verdict.dynamic) << "for what he does he is";
}

TEST(DynamicFeatures, WithoutARuleNothingIsRemoved) {
  Sequence run(options("off"));
  run.contour = MotionState::kMoving;
  (void)run.step({kPerson});
  run.move_in_box(kInBox);
  const FeatureWeights weights = run.step({kPerson});
  EXPECT_EQ(weights.points, std::vector<double>(PointGrid::kSize, 1.0));
  EXPECT_TRUE(weights.dynamic.size().empty());
  EXPECT_FALSE(only_region(weights).verdict.dynamic);
  EXPECT_EQ(only_region(weights).verdict.evidence.moved_points, static_cast<int>(kInBox))
      << "it is seen, though";
}

TEST(DynamicFeatures, EveryRegionIsReportedWithItsEvidence) {
  Sequence run(options("evidence"));
  run.contour = MotionState::kStill;
  (void)run.step({kChair});
  run.move_in_box(2);
  run.dynamics.add_lines({{kSecond, 8, 8}, {kFirst, 4, 1}});
  const FeatureWeights weights = run.step({kChair});
  const Region& region = only_region(weights);
  EXPECT_EQ(region.id, kFirst);
  EXPECT_EQ(region.verdict.evidence.points, static_cast<int>(kInBox));
  EXPECT_EQ(region.verdict.evidence.moved_points, 2);
  EXPECT_EQ(region.verdict.evidence.lines, 4);
  EXPECT_EQ(region.verdict.evidence.moved_lines, 1);
  EXPECT_EQ(region.verdict.evidence.contour, MotionState::kStill);
  for (std::size_t k = 0; k < PointGrid::kSize; ++k) {
    EXPECT_EQ(weights.point_regions[k], in_box(k) ? kFirst : InstanceId{});
  }
}

TEST(DynamicFeatures, ContoursRemoveWhatTheyFoundMoving) {
  for (const MotionState contour : {MotionState::kCandidate, MotionState::kStill, MotionState::kMoving}) {
    Sequence run(options("contours"));
    run.contour = contour;
    (void)run.step({kPerson});
    run.move_in_box(kInBox);
    const FeatureWeights weights = run.step({kPerson});
    const bool moving = contour == MotionState::kMoving;
    EXPECT_EQ(only_region(weights).verdict.dynamic, moving);
    for (std::size_t k = 0; k < PointGrid::kSize; ++k) {
      EXPECT_EQ(weights.point(k), moving && in_box(k) ? 0.0 : 1.0);
    }
  }
}

// Algorithm 1 on a person of whom so many points, and so many of ten lines, move.
struct Algorithm1 {
  [[nodiscard]] bool removes() const {
    DynamicsOptions o = options("algorithm1");
    o.lines.check = line_check;
    Sequence run(o);
    run.contour = contour;
    (void)run.step({kPerson});
    run.move_in_box(points);
    run.dynamics.add_lines({{kFirst, lines, moved_lines}});
    return only_region(run.step({kPerson})).verdict.dynamic;
  }
  MotionState contour = MotionState::kCandidate;
  std::size_t points = 0;
  int lines = 10, moved_lines = 0;
  std::string line_check = "residual";
};

TEST(DynamicFeatures, Algorithm1RemovesWhatTheContoursFound) {
  EXPECT_TRUE((Algorithm1{.contour = MotionState::kMoving}).removes());
  EXPECT_FALSE((Algorithm1{.contour = MotionState::kStill}).removes());
}

TEST(DynamicFeatures, Algorithm1RemovesWherePointsAndLinesMove) {
  EXPECT_TRUE((Algorithm1{.points = 9, .moved_lines = 10}).removes());
  EXPECT_FALSE((Algorithm1{.points = 9, .moved_lines = 0}).removes()) << "points alone";
  EXPECT_FALSE((Algorithm1{.points = 0, .moved_lines = 10}).removes()) << "lines alone";
  EXPECT_FALSE((Algorithm1{.points = 9, .lines = 0}).removes()) << "it has no lines";
  EXPECT_TRUE((Algorithm1{.points = 9, .lines = 0, .line_check = "off"}).removes());
}

TEST(DynamicFeatures, Algorithm1TakesContoursAndFeaturesTogether) {
  EXPECT_TRUE((Algorithm1{.contour = MotionState::kMoving, .points = 9, .moved_lines = 10}).removes());
  EXPECT_TRUE((Algorithm1{.contour = MotionState::kStill, .points = 9, .moved_lines = 10}).removes());
}

TEST(DynamicFeatures, Algorithm1AsksForAShareOfTheFeatures) {
  EXPECT_TRUE((Algorithm1{.points = 2, .moved_lines = 2}).removes()) << "2 of 9 and 2 of 10: from 0.2 on";
  EXPECT_FALSE((Algorithm1{.points = 1, .moved_lines = 2}).removes());
  EXPECT_FALSE((Algorithm1{.points = 2, .moved_lines = 1}).removes());
}

TEST(DynamicFeatures, Algorithm1GoesByAKeyframesLinesUntilTheNext) {
  Sequence run(options("algorithm1"));
  (void)run.step({kPerson});
  run.dynamics.add_lines({{kFirst, 10, 10}});
  for (int i = 0; i < 3; ++i) {
    run.move_in_box(kInBox);
    EXPECT_TRUE(only_region(run.step({kPerson})).verdict.dynamic);
  }
  run.dynamics.add_lines({{kFirst, 10, 0}});
  run.move_in_box(kInBox);
  EXPECT_FALSE(only_region(run.step({kPerson})).verdict.dynamic);
}

TEST(DynamicFeatures, EvidenceHearsAKeyframesLinesOnce) {
  Sequence run(options("evidence"));
  (void)run.step({kPerson});
  run.dynamics.add_lines({{kFirst, 10, 10}});
  EXPECT_EQ(only_region(run.step({kPerson})).verdict.evidence.lines, 10);
  EXPECT_EQ(only_region(run.step({kPerson})).verdict.evidence.lines, 0);
}

TEST(DynamicFeatures, EvidenceKeepsAPersonWhoIsSeenToKeepStill) {
  Sequence run(options("evidence"));
  FeatureWeights weights = run.step({kPerson});
  EXPECT_TRUE(only_region(weights).verdict.dynamic) << "nothing was seen yet: people move";
  EXPECT_NEAR(only_region(weights).verdict.belief, 1.0, 1e-12);
  weights = run.step({kPerson});  // 9 still points are worth more than a frame may count
  EXPECT_FALSE(only_region(weights).verdict.dynamic);
  EXPECT_NEAR(only_region(weights).verdict.belief, 1.0 - 2.0, 1e-12);
  EXPECT_EQ(weights.points, std::vector<double>(PointGrid::kSize, 1.0));
}

TEST(DynamicFeatures, EvidenceRemovesWhatIsSeenToMoveAndNothingElse) {
  Sequence run(options("evidence"));
  const TrackedInstance other = box_instance(kSecond.value, "chair", {420, 170, 141, 141});
  FeatureWeights weights = run.step({kChair, other});
  EXPECT_FALSE(weights.regions->at(0).verdict.dynamic || weights.regions->at(1).verdict.dynamic);
  for (int i = 0; i < 2; ++i) {  // -2 + 2, then + 0.8 * 2
    run.move_in_box(kInBox);
    weights = run.step({kChair, other});
  }
  EXPECT_TRUE(weights.regions->at(0).verdict.dynamic);
  EXPECT_NEAR(weights.regions->at(0).verdict.belief, -2.0 + 3.6, 1e-12);
  EXPECT_FALSE(weights.regions->at(1).verdict.dynamic);
  for (std::size_t k = 0; k < PointGrid::kSize; ++k) EXPECT_EQ(weights.point(k), in_box(k) ? 0.0 : 1.0);
}

TEST(DynamicFeatures, TheCamerasOwnMotionIsNoEvidence) {
  Sequence run(options("evidence"));
  (void)run.step({kPerson}, camera_at({0.0, 0.0, 0.0}));
  // The person's mask moves with the picture by 10 px and more; the points in it stay in it.
  const FeatureWeights weights = run.step({kPerson}, camera_at({0.03, 0.01, 0.02}, 0.01, 0.01));
  EXPECT_GE(only_region(weights).verdict.evidence.points, 6);
  EXPECT_EQ(only_region(weights).verdict.evidence.moved_points, 0);
}

TEST(DynamicFeatures, DynamicRegionsGrow) {
  DynamicsOptions o = options("contours");
  o.growth = 10;
  Sequence run(o);
  Features features = run.grid.look();
  // The box's first column is 220. What counts is the place in the image, with its distortion.
  const auto put = [&](std::size_t k, float x) {
    features.keypoints[k].pixel = {x, 240.0F};
    features.keypoints[k].undistorted = {500.0F - x, 100.0F};
  };
  put(0, 210.0F), put(1, 209.0F);
  run.contour = MotionState::kMoving;
  const FeatureWeights moving = run.step(features, {kPerson});
  EXPECT_EQ(moving.point(0), 0.0);
  EXPECT_EQ(moving.point(1), 1.0);
  EXPECT_EQ(only_region(moving).mask, dilated(box_mask(kBox), 10));
  EXPECT_EQ(moving.dynamic, dilated(box_mask(kBox), 10));
  EXPECT_FALSE(moving.point_regions[0].valid()) << "it is removed with the region, not part of it";
  run.contour = MotionState::kStill;
  const FeatureWeights still = run.step(features, {kPerson});
  EXPECT_EQ(still.point(0), 1.0);
  EXPECT_EQ(only_region(still).mask, box_mask(kBox));
}

TEST(DynamicFeatures, APointInTwoRegionsBelongsToTheFirstAndGoesWithEither) {
  const TrackedInstance second = box_instance(kSecond.value, "chair", kBox);
  const auto weights_with = [&](InstanceId moving) {
    DynamicFeatures dynamics(kTestCamera, kTestPyramid, options("contours"));
    (void)dynamics.locate(SyntheticWorld::make_frame(PointGrid().look()), {kBed, second});
    return dynamics.decide(
        SE3(), [&](InstanceId id) { return id == moving ? MotionState::kMoving : MotionState::kStill; });
  };
  for (const InstanceId moving : {kFirst, kSecond}) {
    const FeatureWeights weights = weights_with(moving);
    for (std::size_t k = 0; k < PointGrid::kSize; ++k) {
      EXPECT_EQ(weights.point_regions[k], in_box(k) ? kFirst : InstanceId{});
      EXPECT_EQ(weights.point(k), in_box(k) ? 0.0 : 1.0);
    }
  }
}

TEST(DynamicFeatures, APointInABedAndOnAPersonIsNoWitness) {
  Sequence run(options("evidence"));
  (void)run.step({kBed, box_instance(kSecond.value, "person", kBox)});
  EXPECT_EQ(sum(run.witness), kOutside);
}

TEST(DynamicFeatures, TheFirstFrameHasNothingToBeComparedWith) {
  Sequence run(options("evidence"));
  const FeatureWeights weights = run.step({kChair});
  EXPECT_EQ(only_region(weights).verdict.evidence.points, 0);
  EXPECT_EQ(weights.points, std::vector<double>(PointGrid::kSize, 1.0));
}

TEST(DynamicFeatures, AfterTheCameraWasLostNothingIsComparedOnce) {
  Sequence run(options("evidence"));
  (void)run.step({kChair});
  EXPECT_EQ(only_region(run.step({kChair}, std::nullopt)).verdict.evidence.points, 0) << "there is no pose";
  run.move_in_box(kInBox);
  EXPECT_EQ(only_region(run.step({kChair})).verdict.evidence.points, 0) << "there was none before";
  run.move_in_box(kInBox);
  EXPECT_EQ(only_region(run.step({kChair})).verdict.evidence.moved_points, static_cast<int>(kInBox));
}

TEST(DynamicFeatures, MorePointsAreAskedForWherePartOfTheImageIsRemoved) {
  DynamicsOptions o = options("contours");
  o.max_feature_factor = 1.5;
  Sequence run(o);
  EXPECT_EQ(run.dynamics.feature_factor(), 1.0);
  run.contour = MotionState::kMoving;
  (void)run.step({kPerson});
  EXPECT_NEAR(run.dynamics.feature_factor(), 1.0 / (1.0 - 141.0 * 141.0 / (640.0 * 480.0)), 1e-12);
  (void)run.step({box_instance(kFirst.value, "person", {0, 0, 640, 480})});
  EXPECT_EQ(run.dynamics.feature_factor(), 1.5);
  run.contour = MotionState::kStill;
  (void)run.step({kPerson});
  EXPECT_EQ(run.dynamics.feature_factor(), 1.0);
}

TEST(DynamicFeatures, BearsAFrameWithoutKeypointsAndAnEmptyMask) {
  for (const char* rule : {"off", "contours", "algorithm1", "evidence"}) {
    Sequence run(options(rule));
    (void)run.step({kPerson});
    const FeatureWeights none = run.step(Features{}, {kPerson});
    EXPECT_TRUE(none.points.empty());
    run.contour = MotionState::kMoving;
    const FeatureWeights empty = run.step({box_instance(kFirst.value, "person", {0, 0, 0, 0})});
    EXPECT_EQ(empty.points, std::vector<double>(PointGrid::kSize, 1.0));
    EXPECT_EQ(only_region(empty).verdict.evidence.points, 0);
  }
}

TEST(DynamicFeatures, WeighPointsByTheirDistance) {
  DynamicsOptions o = options("contours");
  o.weights = "distance";
  Sequence run(o);
  run.contour = MotionState::kMoving;
  (void)run.step({kPerson});
  // Nobody removed is among those that set the scale: the 4 cm in the box do not.
  run.move_in_box(kInBox);
  run.grid.positions[0].x() += 0.02, run.grid.positions[1].x() += 0.005, run.grid.positions[2].x() += 0.0194;
  const FeatureWeights weights = run.step({kPerson});
  // d_min = 0, d_max = 2 cm. Pixels are floats, depths 2 m and more: a micrometre.
  EXPECT_EQ(weights.point(0), 0.0);
  EXPECT_NEAR(weights.point(1), 0.75, 1e-3);
  EXPECT_EQ(weights.point(2), 0.0) << "0.03 is less than the least weight";
  EXPECT_NEAR(weights.point(3), 1.0, 1e-3);
  for (std::size_t k = 0; k < PointGrid::kSize; ++k) {
    EXPECT_EQ(weights.point(k) == 0.0, in_box(k) || k == 0 || k == 2);
  }
}

TEST(DynamicFeatures, WeighPointsByTheirResidual) {
  DynamicsOptions o = options("contours");
  o.weights = "residual";
  o.points.threshold = 8.0;
  Sequence run(o);
  Features features = run.grid.look();
  (void)run.step(features, {kPerson});
  features.keypoints[0].undistorted.x() += 2.0F;   // surprise 4: (sqrt(8/3) - sqrt(4/3)) / (sqrt(8/3) - 1)
  features.keypoints[1].undistorted.x() += 3.0F;   // beyond the threshold
  features.keypoints[2].undistorted.x() += 2.8F;   // surprise 7.84: 0.026, less than the least weight
  features.keypoints[3].undistorted.x() += 40.0F;  // not found: nothing is known
  const FeatureWeights weights = run.step(features, {kPerson});
  EXPECT_NEAR(weights.point(0), 0.7556, 1e-3);
  EXPECT_EQ(weights.point(1), 0.0);
  EXPECT_EQ(weights.point(2), 0.0);
  EXPECT_EQ(weights.point(3), 1.0);
  EXPECT_NEAR(weights.point(4), 1.0, 1e-3);
}

}  // namespace
}  // namespace ipl_slam
