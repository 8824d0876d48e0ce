#include "evaluation/cloud_error.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

TEST(PointIndex, FindsTheNearestPointNearOrFar) {
  PointIndex index(0.1);
  const std::vector<Eigen::Vector3f> points = {{0.0F, 0.0F, 0.0F}, {0.011F, 0.0F, 0.0F}, {-0.5F, 0.2F, 3.0F}};
  for (const Eigen::Vector3f& p : points) index.add(p);
  const auto near = index.nearest({0.009F, 0.0F, 0.0F});
  ASSERT_TRUE(near);
  EXPECT_EQ(near->number, 1U);
  EXPECT_NEAR(near->distance, 0.002, 1e-6);
  const auto far = index.nearest({-0.5F, 0.29F, 3.0F});
  ASSERT_TRUE(far);
  EXPECT_EQ(far->number, 2U);
  EXPECT_FALSE(index.nearest({-0.5F, 0.31F, 3.0F}));
  EXPECT_FALSE(index.any_within({-0.5F, 0.25F, 3.0F}, 0.04));
}

Camera small_camera() {
  Camera camera;
  camera.width = 160, camera.height = 120;
  camera.fx = camera.fy = 130.0;
  camera.cx = 79.5, camera.cy = 59.5;
  return camera;
}

cv::Mat depth_image(double metres) {
  return {120, 160, CV_16UC1, cv::Scalar(metres * 5000.0)};
}

// A wall 2 m before the camera, sampled every centimetre, `error` m in front of where it is.
SemanticCloud wall(double error, double low_x = -1.4, double high_x = 1.4) {
  SemanticCloud cloud;
  for (double x = low_x; x <= high_x; x += 0.01) {
    for (double y = -0.9; y <= 0.9; y += 0.01) {
      CloudPoint point;
      point.position = Eigen::Vector3d(x, y, 2.0 - error).cast<float>();
      cloud.points.push_back(point);
    }
  }
  return cloud;
}

CloudPoint point_at(double x, double y, double z) {
  CloudPoint point;
  point.position = Eigen::Vector3d(x, y, z).cast<float>();
  return point;
}

TEST(CloudError, IsHowFarThePointsAreFromTheSurface) {
  CloudTruth truth(small_camera(), 4.0, true);
  truth.add(depth_image(2.0), {}, SE3());
  const CloudError exact = truth.compare(wall(0.0, -1.1, 1.1), SE3());
  const CloudError off = truth.compare(wall(0.02, -1.1, 1.1), SE3());
  EXPECT_LT(exact.median, 1e-5);
  EXPECT_NEAR(off.median, 0.02, 1e-5);
  EXPECT_EQ(off.far, 0.0);
}

TEST(CloudError, IsTheDistanceToTheNearestMeasurementWhereDepthHasNoise) {
  CloudTruth truth(small_camera(), 4.0);
  truth.add(depth_image(2.0), {}, SE3());
  // Every second pixel is taken, 3.1 cm apart at 2 m: none is farther than 2.2 cm from one.
  const CloudError error = truth.compare(wall(0.0, -1.1, 1.1), SE3());
  EXPECT_GT(error.mean, 0.005);
  EXPECT_LT(error.mean, 0.022);
}

TEST(CloudError, TellsHowMuchOfTheSurfaceIsThere) {
  CloudTruth truth(small_camera(), 4.0);
  truth.add(depth_image(2.0), {}, SE3());
  EXPECT_GT(truth.compare(wall(0.0), SE3()).completeness, 0.99);
  EXPECT_NEAR(truth.compare(wall(0.0, 0.0), SE3()).completeness, 0.5, 0.03);
}

TEST(CloudError, AsksForNothingBeyondTheDepthThatIsFused) {
  CloudTruth truth(small_camera(), 1.9);
  truth.add(depth_image(2.0), {}, SE3());
  const CloudError error = truth.compare(wall(0.0), SE3());
  EXPECT_EQ(error.completeness, 0.0);
  EXPECT_EQ(error.far, 1.0);
}

TEST(CloudError, MovesTheCloudIntoTheWorldOfTheTruth) {
  const SE3 T_wc(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())), {1.0, 2.0, 3.0});
  CloudTruth truth(small_camera(), 4.0);
  truth.add(depth_image(2.0), {}, T_wc);
  EXPECT_GT(truth.compare(wall(0.0), T_wc).completeness, 0.99);
  EXPECT_LT(truth.compare(wall(0.0), SE3()).completeness, 0.1);
}

TEST(CloudError, FitsPosesByTheirRotationsEvenOfACameraThatStandsStill) {
  const SE3 T_ge(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
                 {4, 5, 6});
  Trajectory truth, estimate;
  for (int i = 0; i < 5; ++i) {
    const SE3 T_wc(Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitY())), {0.0, 0.0, 0.0});
    estimate.push_back({1.0 * i, T_wc});
    truth.push_back({1.0 * i, T_ge * T_wc});
  }
  EXPECT_LT((align_poses(truth, estimate) * T_ge.inverse()).log().norm(), 1e-9);
  for (StampedPose& p : truth) p.timestamp += 100.0;
  EXPECT_THROW((void)align_poses(truth, estimate), UserError);
}

TEST(CloudError, CountsWhatLiesOnSomebodyWhoMoved) {
  cv::Mat depth = depth_image(2.0), mask = cv::Mat::zeros(120, 160, CV_8UC1);
  const cv::Rect person(60, 20, 40, 80);
  depth(person) = cv::Scalar(1.0 * 5000.0);
  mask(person) = cv::Scalar(255);
  CloudTruth truth(small_camera(), 4.0);
  truth.add(depth, mask, SE3());

  SemanticCloud cloud = wall(0.0);
  const double clean = truth.compare(cloud, SE3()).ghosts;
  EXPECT_EQ(clean, 0.0);
  cloud.points.push_back(point_at(0.0, 0.0, 1.0));    // on them
  cloud.points.push_back(point_at(0.0, 0.0, 1.2));    // behind them, on nothing
  cloud.points.push_back(point_at(0.05, 0.1, 1.01));  // on them
  EXPECT_DOUBLE_EQ(truth.compare(cloud, SE3()).ghosts, 2.0 / static_cast<double>(cloud.points.size()));
}

TEST(CloudError, LetsPeopleTouchTheFurniture) {
  cv::Mat person = depth_image(1.0), mask(120, 160, CV_8UC1, cv::Scalar(255));
  CloudTruth truth(small_camera(), 4.0);
  truth.add(person, mask, SE3());
  truth.add(depth_image(1.02), {}, SE3());  // a board behind, once they left
  SemanticCloud cloud;
  cloud.points.push_back(point_at(0.0, 0.0, 1.01));
  EXPECT_EQ(truth.compare(cloud, SE3()).ghosts, 0.0);
}

}  // namespace
}  // namespace ipl_slam
