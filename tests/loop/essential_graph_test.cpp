#include "loop/essential_graph.hpp"

#include <gtest/gtest.h>

#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Keyframes of 400 keypoints that share as many landmarks as the test says.
struct Blank {
  Blank() {
    Random random(2);
    for (int i = 0; i < 400; ++i) {
      features.keypoints.push_back({});
      Descriptor descriptor;
      for (auto& word : descriptor) word = random.bits();
      features.descriptors.push_back(descriptor);
    }
    frame = SyntheticWorld::make_frame(features);
  }
  KeyframeId add(PartId part = PartId{0}) {
    used.push_back(0);
    return map.add_keyframe(frame, camera_at({0.1 * static_cast<double>(used.size()), 0.0, 0.0}), nullptr, {},
                            {}, part);
  }
  void share(KeyframeId a, KeyframeId b, int count) {
    for (int i = 0; i < count; ++i) {
      const PointId point = map.add_point({0.0, 0.0, 2.0}, a, used[a.value]++);
      map.add_observation(point, b, used[b.value]++);
    }
  }
  [[nodiscard]] std::vector<std::pair<std::uint32_t, std::uint32_t>> edges(int strong = 100) const {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (const EssentialEdge& edge : essential_graph(map, PartId{0}, {strong}))
      pairs.emplace_back(edge.a.value, edge.b.value);
    return pairs;
  }
  Features features;
  std::shared_ptr<const Frame> frame;
  Map map{kTestPyramid};
  std::vector<std::uint32_t> used;
};

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

TEST(EssentialGraph, TheTreeTakesThePairsThatShareMost) {
  Blank b;
  const KeyframeId k0 = b.add(), k1 = b.add(), k2 = b.add(), k3 = b.add();
  b.share(k0, k2, 50);
  b.share(k0, k3, 30);
  b.share(k1, k3, 40);
  b.share(k2, k1, 20);  // would close a ring, but successive ones stay
  b.share(k2, k3, 10);
  EXPECT_EQ(b.edges(), (Pairs{{0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}));
}

TEST(EssentialGraph, OfWhatClosesARingStrongPairsAndLoopsStay) {
  Blank b;
  std::vector<KeyframeId> k;
  for (int i = 0; i < 6; ++i) k.push_back(b.add());
  for (std::size_t i = 0; i + 1 < 6; ++i) b.share(k[i], k[i + 1], 60);
  b.share(k[0], k[2], 40);
  b.share(k[1], k[4], 20);
  const Pairs chain{{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}};
  EXPECT_EQ(b.edges(), chain);
  EXPECT_EQ(b.edges(40), (Pairs{{0, 1}, {0, 2}, {1, 2}, {2, 3}, {3, 4}, {4, 5}}));
  b.map.add_loop({k[5], k[0], SE3()});
  EXPECT_EQ(b.edges(), (Pairs{{0, 1}, {0, 5}, {1, 2}, {2, 3}, {3, 4}, {4, 5}}));
}

TEST(EssentialGraph, SuccessiveKeyframesTieWhatNoLandmarkDoes) {
  Blank b;
  const KeyframeId k0 = b.add(), k1 = b.add(), k2 = b.add(), k3 = b.add();
  b.share(k0, k1, 50);
  b.share(k2, k3, 50);
  EXPECT_EQ(b.edges(), (Pairs{{0, 1}, {1, 2}, {2, 3}}));
}

TEST(EssentialGraph, AnotherPartIsLeftOut) {
  Blank b;
  const KeyframeId k0 = b.add(), k1 = b.add(), other = b.add(b.map.new_part());
  const KeyframeId k3 = b.add();
  b.share(k0, k1, 50);
  b.share(k1, k3, 50);
  EXPECT_EQ(b.edges(), (Pairs{{0, 1}, {1, 3}}));
  EXPECT_TRUE(essential_graph(b.map, b.map.part_of(other), {}).empty());
}

TEST(EssentialGraph, AnEdgeTellsWhereItsKeyframesStandInTheMap) {
  Blank b;
  const KeyframeId k0 = b.add(), k1 = b.add();
  b.share(k0, k1, 7);
  const auto edges = essential_graph(b.map, PartId{0}, {});
  ASSERT_EQ(edges.size(), 1U);
  EXPECT_EQ(edges[0].shared, 7);
  // Camera 1 stands 10 cm to the right of camera 0.
  EXPECT_LT((edges[0].T_ab * Eigen::Vector3d::Zero() - Eigen::Vector3d(0.1, 0.0, 0.0)).norm(), 1e-12);
}

}  // namespace
}  // namespace ipl_slam
