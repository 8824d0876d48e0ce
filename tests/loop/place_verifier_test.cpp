#include "loop/place_verifier.hpp"

#include <functional>

#include <gtest/gtest.h>

#include "support/line_world.hpp"
#include "support/world_map.hpp"

namespace ipl_slam {
namespace {

using namespace test;

const SE3 kTrue = camera_at({0.3, -0.1, 0.2}, 0.15, 0.4);

PlaceVerifier make_verifier(const PlaceVerifierOptions& options = {}, std::uint64_t seed = 0) {
  return PlaceVerifier(kTestCamera, kTestPyramid, kTestNoise, options, {}, seed);
}

// A map of four keyframes side by side; the last one is the candidate.
class MappedWorld {
 public:
  explicit MappedWorld(const SyntheticWorld& world) : world_map_(world) {
    for (const double x : {-0.6, -0.3, 0.0, 0.3}) {
      candidate = world_map_.add(world.look(camera_at({x, 0.0, 0.0}), frames_++));
    }
  }
  [[nodiscard]] const Map& map() const { return world_map_.map; }
  [[nodiscard]] WorldMap& world_map() { return world_map_; }

  KeyframeId candidate;

 private:
  WorldMap world_map_;
  std::size_t frames_ = 0;
};

Descriptor random_descriptor(Random& random) {
  Descriptor descriptor;
  for (auto& word : descriptor) word = random.bits();
  return descriptor;
}

// The view as it would be if another thing were seen by every keypoint that `replaced` names: the depth there
// is scaled by `depth_factor`.
std::shared_ptr<const Frame> with_other_things(const View& view,
                                               const std::function<bool(const Keypoint&)>& replaced,
                                               float depth_factor = 1.0F) {
  Features features = view.frame->features;
  Random random(3);
  for (std::size_t k = 0; k < features.size(); ++k) {
    if (!replaced(features.keypoints[k])) continue;
    features.descriptors[k] = random_descriptor(random);
    features.keypoints[k].depth *= depth_factor;
  }
  return SyntheticWorld::make_frame(std::move(features), view.frame->index);
}

bool in_left_part(const Keypoint& keypoint, float share) {
  return keypoint.undistorted.x() < share * static_cast<float>(kTestCamera.width);
}

TEST(PlaceVerifier, FindsTheExactPoseInAPerfectWorld) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const View view = world.look(kTrue, 50);
  const auto match = make_verifier().verify(mapped.map(), {*view.frame}, mapped.candidate);
  ASSERT_TRUE(match);
  EXPECT_EQ(match->keyframe, mapped.candidate);
  // Pixels and depths are floats: seven digits.
  EXPECT_LT(pose_difference(match->T_cw, kTrue), 1e-5);
  EXPECT_GT(match->found_share, 0.95);
  EXPECT_EQ(match->cells, 12);
}

TEST(PlaceVerifier, SaysWhichLandmarkEachKeypointShows) {
  const SyntheticWorld world;
  MappedWorld mapped(world);
  const View view = world.look(kTrue, 50);
  const auto match = make_verifier().verify(mapped.map(), {*view.frame}, mapped.candidate);
  ASSERT_TRUE(match);
  int matched = 0;
  for (std::size_t k = 0; k < view.sources.size(); ++k) {
    if (!match->points[k].valid()) continue;
    EXPECT_EQ(match->points[k], mapped.world_map().point_of(view.sources[k]));
    ++matched;
  }
  EXPECT_EQ(matched, match->inliers);
}

TEST(PlaceVerifier, FindsThePoseAmongNoiseAndClutter) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const View view = world.look(
      kTrue, 50, {.pixel_noise = 0.7, .inverse_depth_noise = 0.01, .flipped_bits = 25, .clutter_share = 0.4});
  const auto match = make_verifier().verify(mapped.map(), {*view.frame}, mapped.candidate);
  ASSERT_TRUE(match);
  // Hundreds of points at 3 m, each known to a pixel: millimetres, with a margin of five.
  EXPECT_LT(pose_difference(match->T_cw, kTrue), 0.01);
}

TEST(PlaceVerifier, FindsThePoseOfAViewWithoutDepth) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const View view = world.look(kTrue, 50, {.pixel_noise = 0.7, .depth_share = 0.0, .clutter_share = 0.3});
  const auto match = make_verifier().verify(mapped.map(), {*view.frame}, mapped.candidate);
  ASSERT_TRUE(match);
  EXPECT_LT(pose_difference(match->T_cw, kTrue), 0.01);
}

TEST(PlaceVerifier, FindsThePoseFromAnotherSide) {
  // 30 degrees about what is looked at, and 1 m nearer to it.
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const SE3 T_cw = camera_at({-1.2, 0.0, 0.9}, 0.52);
  const View view = world.look(T_cw, 50, {.pixel_noise = 0.7, .inverse_depth_noise = 0.01});
  const auto match = make_verifier().verify(mapped.map(), {*view.frame}, mapped.candidate);
  ASSERT_TRUE(match);
  EXPECT_LT(pose_difference(match->T_cw, T_cw), 0.01);
}

TEST(PlaceVerifier, RefusesAnotherPlace) {
  const SyntheticWorld world(1), elsewhere(2);
  const MappedWorld mapped(world);
  EXPECT_FALSE(make_verifier().verify(mapped.map(), {*elsewhere.look(kTrue, 50).frame}, mapped.candidate));
}

TEST(PlaceVerifier, RefusesTheSameThingsInOtherPlaces) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  Features features = world.look(kTrue, 50).frame->features;
  Random random(4);
  random.shuffle(features.descriptors);
  const auto frame = SyntheticWorld::make_frame(std::move(features), 50);
  EXPECT_FALSE(make_verifier().verify(mapped.map(), {*frame}, mapped.candidate));
}

TEST(PlaceVerifier, RefusesAPosterThatHangsOnAnotherWall) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const auto frame = with_other_things(world.look(kTrue, 50), [](const Keypoint& keypoint) {
    return (keypoint.undistorted - Eigen::Vector2f(320.0F, 240.0F)).cwiseAbs().maxCoeff() > 100.0F;
  });
  const auto verify = [&](PlaceVerifierOptions options) {
    options.min_inliers = 40;  // the world has fewer points than a picture: no want of them refuses it
    return make_verifier(options).verify(mapped.map(), {*frame}, mapped.candidate);
  };
  EXPECT_FALSE(verify({})) << "it fills too little of the image";
  EXPECT_FALSE(verify({.min_found_share = 0.2, .min_cell_share = 0.0})) << "too much around it is missing";
  EXPECT_TRUE(verify({.min_cell_share = 0.0}));
}

TEST(PlaceVerifier, RefusesTheSamePosterWhereTheWallAroundItIsHidden) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const auto elsewhere = [](const Keypoint& keypoint) {
    return keypoint.undistorted.x() < 345.0F || keypoint.undistorted.y() < 345.0F;
  };
  const auto frame = with_other_things(world.look(kTrue, 50), elsewhere, 0.4F);
  EXPECT_FALSE(make_verifier({.min_inliers = 10}).verify(mapped.map(), {*frame}, mapped.candidate));
  EXPECT_TRUE(make_verifier({.min_inliers = 10, .min_cells = 1, .min_cell_share = 0.0})
                  .verify(mapped.map(), {*frame}, mapped.candidate));
}

TEST(PlaceVerifier, DoesNotExpectWhatSomeoneStandsBefore) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const View view = world.look(kTrue, 50);
  const auto covered = [](const Keypoint& keypoint) { return in_left_part(keypoint, 0.6F); };
  const auto share = [&](const std::shared_ptr<const Frame>& frame) {
    const auto match = make_verifier({.min_found_share = 0.0, .min_cell_share = 0.0})
                           .verify(mapped.map(), {*frame}, mapped.candidate);
    return match ? match->found_share : -1.0;
  };
  // The points of this world lie 1.5 to 4.5 m away, so someone at 0.6 of that hides nearly all behind.
  EXPECT_GT(share(with_other_things(view, covered, 0.4F)), 0.8);
  EXPECT_LT(share(with_other_things(view, covered)), 0.55);
}

TEST(PlaceVerifier, NeitherUsesNorMissesWhatWasRemoved) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const View view = world.look(kTrue, 50);
  FeatureTrust trust;
  for (const Keypoint& keypoint : view.frame->features.keypoints) {
    trust.weights.push_back(in_left_part(keypoint, 0.6F) ? 0.0 : 1.0);
  }
  const auto match = make_verifier().verify(mapped.map(), {*view.frame, trust}, mapped.candidate);
  ASSERT_TRUE(match);
  for (std::size_t k = 0; k < trust.weights.size(); ++k) {
    if (trust.weights[k] == 0.0) {
      EXPECT_FALSE(match->points[k].valid());
    }
  }
  EXPECT_GT(match->found_share, 0.9);
}

TEST(PlaceVerifier, LooksForWhatTheNeighboursSeeToo) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const View view = world.look(camera_at({-1.2, 0.0, 0.0}), 50);
  const auto alone = make_verifier({.neighbours = 0}).verify(mapped.map(), {*view.frame}, mapped.candidate);
  const auto group = make_verifier().verify(mapped.map(), {*view.frame}, mapped.candidate);
  ASSERT_TRUE(alone && group);
  EXPECT_GT(group->inliers, alone->inliers + 50);
}

TEST(PlaceVerifier, AnEmptyFrameOrKeyframeIsNowhere) {
  const SyntheticWorld world;
  MappedWorld mapped(world);
  const auto empty = SyntheticWorld::make_frame({}, 50);
  EXPECT_FALSE(make_verifier().verify(mapped.map(), {*empty}, mapped.candidate));
  EXPECT_FALSE(make_verifier().confirms(mapped.map(), {*empty}, kTrue, mapped.candidate));
  const KeyframeId blind = mapped.world_map().map.add_keyframe(empty, kTrue);
  const View view = world.look(kTrue, 51);
  EXPECT_FALSE(make_verifier().verify(mapped.map(), {*view.frame}, blind));
  EXPECT_FALSE(make_verifier().confirms(mapped.map(), {*view.frame}, kTrue, blind));
}

TEST(PlaceVerifier, AFurtherViewConfirmsThePoseItHasAndNoOther) {
  const SyntheticWorld world, elsewhere(2);
  const MappedWorld mapped(world);
  const PlaceVerifier verifier = make_verifier();
  const View view = world.look(kTrue, 50);
  // Nearly right will do: the search looks a few pixels around.
  const SE3 nearly = camera_at({0.005, 0.0, 0.005}) * kTrue;
  EXPECT_TRUE(verifier.confirms(mapped.map(), {*view.frame}, kTrue, mapped.candidate));
  EXPECT_TRUE(verifier.confirms(mapped.map(), {*view.frame}, nearly, mapped.candidate));
  const SE3 far_off = camera_at({0.5, 0.0, 0.0}) * kTrue;
  EXPECT_FALSE(verifier.confirms(mapped.map(), {*view.frame}, far_off, mapped.candidate));
  EXPECT_FALSE(verifier.confirms(mapped.map(), {*elsewhere.look(kTrue, 50).frame}, kTrue, mapped.candidate));
}

TEST(PlaceVerifier, GivesTheSameBitsEveryTime) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const View view =
      world.look(kTrue, 50, {.pixel_noise = 1.0, .inverse_depth_noise = 0.01, .clutter_share = 0.4});
  const auto first = make_verifier().verify(mapped.map(), {*view.frame}, mapped.candidate);
  const auto second = make_verifier().verify(mapped.map(), {*view.frame}, mapped.candidate);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->T_cw.translation(), second->T_cw.translation());
  EXPECT_EQ(first->T_cw.rotation().coeffs(), second->T_cw.rotation().coeffs());
  EXPECT_EQ(first->points, second->points);
}

// A room with few points, of which all that show lie in one direction, and the edges of LineWorld.
class PlaceVerifierLines : public ::testing::Test {
 protected:
  PlaceVerifierLines() {
    for (const double x : {-0.2, -0.1, 0.0, 0.1}) {
      const SE3 T_cw = camera_at({x, 0.0, 0.0});
      const View view = points_.look(T_cw, frames_);
      const LineView lines = lines_.look(T_cw, frames_++);
      candidate_ = map_.add_keyframe(view.frame, T_cw, lines.lines);
      for (std::uint32_t k = 0; k < view.sources.size(); ++k) {
        see(points_of_[view.sources[k]], k,
            [&] { return map_.add_point(points_.position(view.sources[k]), candidate_, k); });
      }
      for (std::uint32_t s = 0; s < lines.sources.size(); ++s) {
        const Edge& edge = lines_.edge(lines.sources[s]);
        see(lines_of_[lines.sources[s]], s, [&] {
          return map_.add_line(*Line3::through(edge.start, edge.end), edge.start, edge.end, candidate_, s);
        });
      }
    }
  }

  // The candidate sees a landmark, made by `make` where there is none yet.
  template <class LandmarkId, class Make>
  void see(LandmarkId& id, std::uint32_t feature, const Make& make) {
    if (!id.valid()) {
      id = make();
    } else {
      map_.add_observation(id, candidate_, feature);
      map_.refresh(id);
    }
  }

  SyntheticWorld points_{1, 300};
  LineWorld lines_;
  std::vector<PointId> points_of_ = std::vector<PointId>(points_.size());
  std::vector<LineId> lines_of_ = std::vector<LineId>(lines_.size());
  Map map_{kTestPyramid};
  KeyframeId candidate_;
  std::size_t frames_ = 0;
};

TEST_F(PlaceVerifierLines, FindsTheLinesOfThePlace) {
  const SE3 T_cw = camera_at({0.15, -0.05, 0.1}, 0.05);
  const View view = points_.look(T_cw, 50);
  const LineView lines = lines_.look(T_cw, 50);
  const auto match = make_verifier().verify(map_, {*view.frame, {}, lines.lines.get()}, candidate_);
  ASSERT_TRUE(match);
  ASSERT_EQ(match->lines.size(), lines.sources.size());
  int found = 0;
  for (std::size_t s = 0; s < lines.sources.size(); ++s) {
    if (!match->lines[s].valid()) continue;
    EXPECT_EQ(match->lines[s], lines_of_[lines.sources[s]]);
    ++found;
  }
  EXPECT_EQ(found, match->line_inliers);
  EXPECT_GT(found, 40);
}

TEST_F(PlaceVerifierLines, LinesMakeThePoseBetter) {
  const SE3 T_cw = camera_at({0.15, -0.05, 0.1}, 0.05);
  const LineView lines = lines_.look(T_cw, 50);
  double with = 0.0, without = 0.0;
  for (std::size_t frame = 50; frame < 60; ++frame) {
    const View view = points_.look(T_cw, frame, {.pixel_noise = 2.0, .depth_share = 0.0});
    const PlaceVerifier verifier = make_verifier({.min_inliers = 40, .min_found_share = 0.0});
    const auto both = verifier.verify(map_, {*view.frame, {}, lines.lines.get()}, candidate_);
    const auto points = verifier.verify(map_, {*view.frame}, candidate_);
    ASSERT_TRUE(both && points) << frame;
    with += pose_difference(both->T_cw, T_cw);
    without += pose_difference(points->T_cw, T_cw);
  }
  EXPECT_LT(with, 0.7 * without);
}

TEST_F(PlaceVerifierLines, RemovedLinesAreNotUsed) {
  const SE3 T_cw = camera_at({0.15, -0.05, 0.1}, 0.05);
  const View view = points_.look(T_cw, 50);
  const LineView lines = lines_.look(T_cw, 50);
  const FeatureTrust removed{std::vector<double>(lines.sources.size(), 0.0), {}};
  const auto match = make_verifier().verify(map_, {*view.frame, {}, lines.lines.get(), removed}, candidate_);
  ASSERT_TRUE(match);
  EXPECT_EQ(match->line_inliers, 0);
}

}  // namespace
}  // namespace ipl_slam
