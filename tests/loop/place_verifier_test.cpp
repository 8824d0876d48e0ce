#include "loop/place_verifier.hpp"

#include <gtest/gtest.h>

#include "support/world_map.hpp"

namespace ipl_slam {
namespace {

using namespace test;

const SE3 kTrue = camera_at({0.3, -0.1, 0.2}, 0.15, 0.4);

PlaceVerifier verifier(const PlaceVerifierOptions& options = {}, std::uint64_t seed = 0) {
  return PlaceVerifier(kTestCamera, kTestPyramid, kTestNoise, options, {}, seed);
}

// A map of four keyframes that see the same room.
struct MappedWorld {
  explicit MappedWorld(const SyntheticWorld& world) : map(world) {
    for (std::size_t i = 0; i < 4; ++i) {
      candidate = map.add(world.look(camera_at({-0.45 + 0.3 * static_cast<double>(i), 0.0, 0.0}), i));
    }
  }
  WorldMap map;
  KeyframeId candidate;
};

TEST(PlaceVerifier, FindsTheExactPoseInAPerfectWorld) {
  const SyntheticWorld world;
  const MappedWorld mapped(world);
  const View view = world.look(kTrue, 50);
  const auto match = verifier().verify(mapped.map.map, {*view.frame}, mapped.candidate);
  ASSERT_TRUE(match);
  // Pixels and depths are floats: seven digits.
  EXPECT_LT(pose_difference(match->T_cw, kTrue), 1e-5);
  EXPECT_GT(match->found_share, 0.9);
}

}  // namespace
}  // namespace ipl_slam
