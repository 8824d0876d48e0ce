#include "dense/voxel_grid.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

TEST(VoxelGrid, FindsTheVoxelOfAPointOnEitherSideOfTheOrigin) {
  const VoxelGrid grid(0.01);
  EXPECT_EQ(grid.voxel_of({0.015, -0.005, -0.085}), (VoxelCoord{1, -1, -9}));
  EXPECT_EQ(VoxelGrid::block_of({1, -1, -9}), (BlockCoord{0, -1, -2}));
  EXPECT_EQ(VoxelGrid::index_in_block({1, -1, -9}), VoxelBlock::index(1, 7, 7));
  EXPECT_LT((grid.centre({1, -1, -9}) - Eigen::Vector3d(0.015, -0.005, -0.085)).norm(), 1e-12);
}

TEST(VoxelGrid, KeepsTheOtherBlocksWhenOneIsErased) {
  VoxelGrid grid(0.01);
  for (int x = 0; x < 5; ++x) grid.make({x, 0, 0}).weight[0] = static_cast<std::uint16_t>(x + 1);
  grid.erase({1, 0, 0});
  grid.erase({7, 7, 7});
  EXPECT_EQ(grid.find({1, 0, 0}), nullptr);
  for (const int x : {0, 2, 3, 4}) {
    ASSERT_NE(grid.find({x, 0, 0}), nullptr);
    EXPECT_EQ(grid.find({x, 0, 0})->weight[0], x + 1);
  }
  EXPECT_EQ(grid.sorted(), (std::vector<BlockCoord>{{0, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}}));
}

TEST(VoxelGrid, MakesABlockOnce) {
  VoxelGrid grid(0.01);
  VoxelBlock& block = grid.make({-3, 2, 1});
  block.free[5] = 9;
  EXPECT_EQ(&grid.make({-3, 2, 1}), &block);
  EXPECT_EQ(grid.blocks().size(), 1U);
  EXPECT_GE(grid.bytes(), sizeof(VoxelBlock));
}

}  // namespace
}  // namespace ipl_slam
