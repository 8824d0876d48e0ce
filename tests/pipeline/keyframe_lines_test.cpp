#include "pipeline/keyframe_lines.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "support/line_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

constexpr InstanceId kLeft{2}, kRight{6};

LineMotionOptions motion_options() {
  LineMotionOptions o;
  o.check = "residual";
  o.min_weight = 0.1;
  o.pixel_sigma = 1.0;
  o.inverse_depth_sigma = 0.01;
  o.max_chi2 = 18.47;
  return o;
}

KeyframeLines keyframe_lines(double max_dynamic_share = 0.2) {
  return {LineExtractor(LineMethod{}, {}, kTestCamera, {}), LineMotionCheck(kTestCamera, motion_options()),
          max_dynamic_share};
}

BitMask columns(int first, int last) {
  BitMask mask(cv::Size(kTestCamera.width, kTestCamera.height));
  for (int y = 0; y < kTestCamera.height; ++y) mask.set_run(y, first, last);
  return mask;
}

Region still(InstanceId id, BitMask mask) {
  return {.id = id, .mask = std::move(mask), .verdict = {.dynamic = false}};
}
Region moving(InstanceId id, BitMask mask) {
  return {.id = id, .mask = std::move(mask), .verdict = {.dynamic = true}};
}

// What was decided on a frame with these regions.
FeatureWeights weights_of(std::vector<Region> regions) {
  FeatureWeights weights;
  for (const Region& region : regions) {
    if (!region.verdict.dynamic) continue;
    if (weights.dynamic.size().empty()) weights.dynamic = BitMask(region.mask.size());
    weights.dynamic |= region.mask;
  }
  weights.regions = std::make_shared<const std::vector<Region>>(std::move(regions));
  return weights;
}

NewKeyframe with_lines(LineFeatures lines, FeatureWeights weights, const SE3& T_cw = {}) {
  NewKeyframe keyframe;
  keyframe.candidate.tracked.T_cw = T_cw;
  keyframe.candidate.tracked.weights = std::move(weights);
  keyframe.candidate.lines = std::make_shared<const LineFeatures>(std::move(lines));
  return keyframe;
}

// Level edges, 100 px long, 2 m away, from these left ends; each with a descriptor of its own.
LineFeatures level_edges(const std::vector<Eigen::Vector2d>& starts, const SE3& T_cw = {}) {
  LineFeatures lines;
  Random random(1);
  for (const Eigen::Vector2d& uv : starts) {
    const Edge edge{kTestCamera.unproject(uv, 2.0),
                    kTestCamera.unproject(uv + Eigen::Vector2d(100.0, 0.0), 2.0)};
    lines.segments.push_back(exact_segment(kTestCamera, T_cw, edge));
    lines.descriptors.push_back({random.bits(), random.bits(), random.bits(), random.bits()});
  }
  return lines;
}

void shift_down(LineSegment& segment, float pixels) {
  for (Eigen::Vector2f* p : {&segment.start, &segment.end, &segment.start_pixel, &segment.end_pixel})
    p->y() += pixels;
}

TEST(KeyframeLines, ExtractsThemFromTheImagesWhereThereAreNone) {
  const LineWorld world;
  NewKeyframe keyframe;
  keyframe.grey = world.image({});
  keyframe.depth = world.depth({});
  EXPECT_TRUE(keyframe_lines().process(keyframe).empty()) << "there is no region to tell of";
  ASSERT_TRUE(keyframe.candidate.lines);
  const std::size_t n = keyframe.candidate.lines->size();
  EXPECT_GT(n, 30U);
  EXPECT_EQ(keyframe.candidate.line_trust.weights, std::vector<double>(n, 1.0));
  EXPECT_EQ(keyframe.candidate.line_trust.regions, std::vector<InstanceId>(n));
}

TEST(KeyframeLines, KeepsThoseTheCandidateHasAlready) {
  const LineWorld world;
  NewKeyframe keyframe = with_lines(level_edges({{100.0, 100.0}}), {});
  keyframe.grey = world.image({});
  const auto own = keyframe.candidate.lines;
  (void)keyframe_lines().process(keyframe);
  EXPECT_EQ(keyframe.candidate.lines, own);
  EXPECT_EQ(keyframe.candidate.line_trust.weights.size(), 1U);
}

TEST(KeyframeLines, ASegmentBelongsToTheRegionThatHoldsHalfOfIt) {
  // Of the 100 px from u = 200 on, 75, 50 and 25 lie left of the border.
  for (const auto& [border, inside] : {std::pair{275, true}, {250, true}, {225, false}}) {
    NewKeyframe keyframe =
        with_lines(level_edges({{200.0, 100.0}}), weights_of({still(kLeft, columns(0, border))}));
    (void)keyframe_lines().process(keyframe);
    EXPECT_EQ(keyframe.candidate.line_trust.regions.at(0), inside ? kLeft : InstanceId{});
    EXPECT_EQ(keyframe.candidate.line_trust.weights.at(0), 1.0) << "the region is still";
  }
}

TEST(KeyframeLines, ASegmentWithTooMuchInDynamicRegionsIsRemoved) {
  for (const auto& [border, weight] : {std::pair{245, 0.0}, {230, 1.0}}) {  // 45 and 30 px of 100
    NewKeyframe keyframe =
        with_lines(level_edges({{200.0, 100.0}}), weights_of({moving(kLeft, columns(0, border))}));
    (void)keyframe_lines(0.4).process(keyframe);
    EXPECT_EQ(keyframe.candidate.line_trust.weights.at(0), weight);
    EXPECT_FALSE(keyframe.candidate.line_trust.regions.at(0).valid()) << "it reaches out by more than half";
  }
}

TEST(KeyframeLines, DynamicRegionsAddUpAlongASegment) {
  // 15 px at either end; a region alone would not do.
  const auto weight = [](bool both) {
    NewKeyframe keyframe =
        with_lines(level_edges({{200.0, 100.0}}),
                   weights_of({moving(kLeft, columns(0, 215)),
                               both ? moving(kRight, columns(285, 640)) : still(kRight, columns(285, 640))}));
    (void)keyframe_lines(0.2).process(keyframe);
    return keyframe.candidate.line_trust.weights.at(0);
  };
  EXPECT_EQ(weight(false), 1.0);
  EXPECT_EQ(weight(true), 0.0);
}

TEST(KeyframeLines, TheMaskIsThatOfTheImageWithItsDistortion) {
  LineFeatures lines = level_edges({{200.0, 100.0}});
  lines.segments[0].start_pixel.x() = 400.0F, lines.segments[0].end_pixel.x() = 500.0F;
  NewKeyframe keyframe = with_lines(lines, weights_of({moving(kRight, columns(350, 640))}));
  (void)keyframe_lines().process(keyframe);
  EXPECT_EQ(keyframe.candidate.line_trust.regions.at(0), kRight);
  EXPECT_EQ(keyframe.candidate.line_trust.weights.at(0), 0.0);
}

// Seven edges: three on the left, two on the right, two between.
const std::vector<Eigen::Vector2d> kStarts{{40.0, 60.0},   {40.0, 200.0}, {40.0, 340.0}, {480.0, 60.0},
                                           {480.0, 200.0}, {270.0, 60.0}, {270.0, 200.0}};
FeatureWeights left_and_right() {
  return weights_of({still(kLeft, columns(0, 200)), still(kRight, columns(440, 640))});
}

TEST(KeyframeLines, TheFirstKeyframeTellsOfItsRegionsButOfNoMotion) {
  NewKeyframe keyframe = with_lines(level_edges(kStarts), left_and_right());
  const std::vector<RegionLines> told = keyframe_lines().process(keyframe);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].region, kLeft);
  EXPECT_EQ(told[1].region, kRight);
  for (const RegionLines& region : told) EXPECT_EQ(region.lines + region.moved, 0);
  EXPECT_EQ(keyframe.candidate.line_trust.weights, std::vector<double>(kStarts.size(), 1.0));
  EXPECT_EQ(keyframe.candidate.line_trust.regions,
            (std::vector<InstanceId>{kLeft, kLeft, kLeft, kRight, kRight, {}, {}}));
}

TEST(KeyframeLines, CountsTheLinesOfEachRegionAndThoseThatMoved) {
  KeyframeLines lines = keyframe_lines();
  NewKeyframe first = with_lines(level_edges(kStarts), left_and_right());
  (void)lines.process(first);
  LineFeatures now = level_edges(kStarts);
  shift_down(now.segments[0], 20.0F);  // in the left region
  shift_down(now.segments[5], 20.0F);  // in none
  now.descriptors[2] = {~now.descriptors[2][0], ~now.descriptors[2][1], ~now.descriptors[2][2],
                        ~now.descriptors[2][3]};  // something else
  NewKeyframe second = with_lines(now, left_and_right());
  const std::vector<RegionLines> told = lines.process(second);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].lines, 2) << "the third has no like in the keyframe before";
  EXPECT_EQ(told[0].moved, 1);
  EXPECT_EQ(told[1].lines, 2);
  EXPECT_EQ(told[1].moved, 0);
  EXPECT_EQ(second.candidate.line_trust.weights, (std::vector<double>{0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0}))
      << "what moved is dropped, whatever it lies in";
}

TEST(KeyframeLines, TheCamerasOwnMotionIsTakenOut) {
  // From one camera to the next 0.05 m to the right: 13 px, and 10 px up.
  KeyframeLines lines = keyframe_lines();
  const SE3 T_first = camera_at({0.1, -0.06, 0.0}), T_second = camera_at({0.15, -0.02, 0.0});
  NewKeyframe first = with_lines(level_edges(kStarts, T_first), left_and_right(), T_first);
  (void)lines.process(first);
  NewKeyframe second = with_lines(level_edges(kStarts, T_second), left_and_right(), T_second);
  const std::vector<RegionLines> told = lines.process(second);
  EXPECT_EQ(told.at(0).lines, 3);
  EXPECT_EQ(told.at(0).moved, 0);
  EXPECT_EQ(second.candidate.line_trust.weights, std::vector<double>(kStarts.size(), 1.0));
}

TEST(KeyframeLines, ComparesWithTheKeyframeBeforeNotWithTheFirst) {
  KeyframeLines lines = keyframe_lines();
  LineFeatures now = level_edges(kStarts);
  std::vector<RegionLines> told;
  for (const float shift : {0.0F, 20.0F, 0.0F}) {
    shift_down(now.segments[0], shift);
    NewKeyframe keyframe = with_lines(now, left_and_right());
    told = lines.process(keyframe);
  }
  EXPECT_EQ(told.at(0).lines, 3);
  EXPECT_EQ(told.at(0).moved, 0) << "it stands again";
}

TEST(KeyframeLines, BearsAKeyframeWithoutLines) {
  KeyframeLines lines = keyframe_lines();
  for (int i = 0; i < 2; ++i) {
    NewKeyframe none = with_lines({}, left_and_right());
    const std::vector<RegionLines> told = lines.process(none);
    EXPECT_EQ(told.size(), 2U);
    EXPECT_TRUE(none.candidate.line_trust.weights.empty());
  }
  NewKeyframe some = with_lines(level_edges(kStarts), left_and_right());
  EXPECT_EQ(lines.process(some).at(0).lines, 0);
}

}  // namespace
}  // namespace ipl_slam
