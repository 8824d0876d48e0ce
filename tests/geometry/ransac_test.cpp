#include "geometry/ransac.hpp"

#include <random>

#include <gtest/gtest.h>

#include "geometry/alignment.hpp"

namespace ipl_slam {
namespace {

class TestRandom {
 public:
  explicit TestRandom(std::uint64_t seed) : engine_(seed) {}
  std::uint64_t index(std::uint64_t count) { return (engine_() >> 32) * count >> 32; }
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) * 0x1.0p-64;
  }

 private:
  std::mt19937_64 engine_;
};

Eigen::Vector3d point_in_box(TestRandom& random, double half_side) {
  const double x = random.uniform(-half_side, half_side), y = random.uniform(-half_side, half_side);
  return {x, y, random.uniform(-half_side, half_side)};
}

const SE3 kTrue = SE3::exp((Vector6d() << 0.5, -1.0, 2.0, 0.7, 0.2, -1.1).finished());

struct Pairs {
  std::vector<Eigen::Vector3d> a, b;
};

// `outliers` of the pairs come first and have nothing to do with each other; the rest is off by up to `noise`
// a side.
Pairs pairs(int count, int outliers, double noise) {
  TestRandom random(7);
  Pairs p;
  for (int i = 0; i < count; ++i) {
    p.a.push_back(point_in_box(random, 2.0));
    p.b.push_back(i < outliers ? Eigen::Vector3d(point_in_box(random, 4.0))
                               : Eigen::Vector3d(kTrue * p.a.back() + point_in_box(random, noise)));
  }
  return p;
}

double distance(const SE3& a, const SE3& b) {
  return (a * b.inverse()).log().norm();
}

TEST(AlignRigid, recovers_the_transform_of_exact_points) {
  const Pairs p = pairs(10, 0, 0.0);
  const auto T_ba = align_rigid(p.a, p.b);
  ASSERT_TRUE(T_ba);
  EXPECT_LT(distance(*T_ba, kTrue), 1e-13);  // roundings of a 3x3 decomposition
}

TEST(AlignRigid, needs_no_more_than_three_points_or_a_plane) {
  const Pairs p = pairs(3, 0, 0.0);
  const auto T_ba = align_rigid(p.a, p.b);
  ASSERT_TRUE(T_ba);
  EXPECT_LT(distance(*T_ba, kTrue), 1e-12);
}

TEST(AlignRigid, never_answers_with_a_reflection) {
  const std::vector<Eigen::Vector3d> a = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};
  std::vector<Eigen::Vector3d> b = a;
  for (auto& p : b) p.z() = -p.z();
  const auto T_ba = align_rigid(a, b);
  ASSERT_TRUE(T_ba);
  EXPECT_NEAR(T_ba->rotation_matrix().determinant(), 1.0, 1e-12);
}

TEST(AlignRigid, gives_nothing_where_the_rotation_is_open) {
  const std::vector<Eigen::Vector3d> two = {{0, 0, 0}, {1, 2, 3}};
  const std::vector<Eigen::Vector3d> line = {{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {3, 6, 9}};
  const std::vector<Eigen::Vector3d> spot(5, Eigen::Vector3d(1, 2, 3));
  const std::vector<Eigen::Vector3d> broken = {{0, 0, 0}, {1, 0, 0}, {0, 1, std::nan("")}};
  EXPECT_FALSE(align_rigid(two, two));
  EXPECT_FALSE(align_rigid(line, line));
  EXPECT_FALSE(align_rigid(spot, spot));
  EXPECT_FALSE(align_rigid(broken, broken));
  EXPECT_THROW((void)align_rigid(two, line), std::invalid_argument);
}

TEST(Ransac, finds_the_model_among_sixty_percent_outliers) {
  const Pairs p = pairs(100, 60, 0.01);
  TestRandom random(1);
  const auto result = ransac(RigidAlignmentEstimator(p.a, p.b), {.threshold = 0.03}, random);
  ASSERT_TRUE(result);
  EXPECT_LT(distance(result->model, kTrue), 0.01);  // forty pairs average noise of 0.01 to well below it
  ASSERT_EQ(result->inliers.size(), 40u);
  for (std::uint32_t i = 0; i < 40; ++i) EXPECT_EQ(result->inliers[i], 60 + i);
}

TEST(Ransac, stops_early_where_outliers_are_few) {
  TestRandom random(1);
  const Pairs clean = pairs(100, 0, 0.01), dirty = pairs(100, 60, 0.01);
  const auto easy = ransac(RigidAlignmentEstimator(clean.a, clean.b), {.threshold = 0.1}, random);
  const auto hard = ransac(RigidAlignmentEstimator(dirty.a, dirty.b), {.threshold = 0.1}, random);
  ASSERT_TRUE(easy && hard);
  EXPECT_LE(easy->iterations, 3);
  // 99 % confidence with 40 % inliers and samples of three: log(0.01) / log(1 - 0.4^3) = 69.6
  EXPECT_GE(hard->iterations, 60);
  EXPECT_LT(hard->iterations, 1000);
}

TEST(Ransac, gives_nothing_for_too_few_data_or_too_few_inliers) {
  TestRandom random(1);
  const Pairs two = pairs(2, 0, 0.0), noise = pairs(50, 50, 0.0), good = pairs(50, 20, 0.0);
  EXPECT_FALSE(ransac(RigidAlignmentEstimator(two.a, two.b), {.threshold = 0.1}, random));
  EXPECT_FALSE(ransac(RigidAlignmentEstimator({}, {}), {.threshold = 0.1}, random));
  EXPECT_FALSE(
      ransac(RigidAlignmentEstimator(noise.a, noise.b), {.threshold = 0.01, .min_inliers = 10}, random));
  EXPECT_TRUE(
      ransac(RigidAlignmentEstimator(good.a, good.b), {.threshold = 0.01, .min_inliers = 30}, random));
  EXPECT_FALSE(
      ransac(RigidAlignmentEstimator(good.a, good.b), {.threshold = 0.01, .min_inliers = 31}, random));
}

TEST(Ransac, gives_nothing_where_every_sample_is_degenerate) {
  const std::vector<Eigen::Vector3d> line = {{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {3, 6, 9}};
  TestRandom random(1);
  EXPECT_FALSE(ransac(RigidAlignmentEstimator(line, line), {.threshold = 0.1, .max_iterations = 50}, random));
}

TEST(Ransac, takes_data_that_are_not_numbers_for_outliers) {
  Pairs p = pairs(30, 5, 0.001);
  p.b[0].setConstant(std::nan(""));
  TestRandom random(3);
  const auto result = ransac(RigidAlignmentEstimator(p.a, p.b), {.threshold = 0.01}, random);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->inliers.size(), 25u);
  EXPECT_TRUE(std::isfinite(result->score));
}

TEST(Ransac, gives_the_same_result_for_the_same_seed) {
  const Pairs p = pairs(100, 60, 0.01);
  const auto run = [&](std::uint64_t seed) {
    TestRandom random(seed);
    return ransac(RigidAlignmentEstimator(p.a, p.b), {.threshold = 0.015}, random);
  };
  const auto first = run(5), second = run(5);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->model.rotation().coeffs(), second->model.rotation().coeffs());
  EXPECT_EQ(first->model.translation(), second->model.translation());
  EXPECT_EQ(first->inliers, second->inliers);
  EXPECT_EQ(first->iterations, second->iterations);
}

TEST(Ransac, draws_every_index_and_never_one_twice_in_a_sample) {
  TestRandom random(1);
  std::vector<int> drawn(5, 0);
  for (int i = 0; i < 200; ++i) {
    const auto sample = ransac_detail::draw_distinct<3>(5, random);
    EXPECT_TRUE(sample[0] != sample[1] && sample[0] != sample[2] && sample[1] != sample[2]);
    for (const std::uint32_t s : sample) ++drawn.at(s);
  }
  for (const int count : drawn)
    EXPECT_NEAR(count, 120, 40);  // 200 x 3/5; 40 is nearly six standard deviations
}

}  // namespace
}  // namespace ipl_slam
