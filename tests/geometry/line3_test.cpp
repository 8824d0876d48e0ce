#include "geometry/line3.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

const Camera kCamera{.fx = 517.0, .fy = 490.0, .cx = 318.0, .cy = 255.0};
const SE3 kPose = SE3::exp((Vector6d() << 0.2, -0.4, 0.3, 0.5, -0.2, 0.9).finished());

struct Ends {
  Eigen::Vector3d a, b;
};

// Camera-frame segments: across, upwards, away from the camera, towards it, and at a slant.
const std::vector<Ends> kSegments = {{{-1.0, 0.2, 2.0}, {1.0, 0.2, 2.0}},
                                     {{0.3, 1.0, 3.0}, {0.3, -1.0, 3.0}},
                                     {{0.4, 0.5, 1.0}, {0.4, 0.5, 6.0}},
                                     {{-0.7, 0.1, 4.0}, {-0.4, 0.2, 1.5}},
                                     {{-1.5, -1.0, 5.0}, {0.8, 1.2, 2.0}}};

Line3 line_of(const Ends& ends) {
  return *Line3::through(ends.a, ends.b);
}

void expect_near(const Eigen::VectorXd& actual, const Eigen::VectorXd& expected, double tolerance) {
  EXPECT_LT((actual - expected).norm(), tolerance)
      << actual.transpose() << " instead of " << expected.transpose();
}

TEST(Line3, runs_from_the_first_point_to_the_second) {
  const Line3 line = *Line3::through({1.0, 2.0, 3.0}, {1.0, 2.0, 7.0});
  expect_near(line.direction, Eigen::Vector3d::UnitZ(), 1e-15);
  expect_near(line.moment, Eigen::Vector3d(2.0, -1.0, 0.0), 1e-15);
}

TEST(Line3, has_a_moment_at_a_right_angle_and_as_long_as_its_distance_from_the_origin) {
  for (const Ends& ends : kSegments) {
    const Line3 line = line_of(ends);
    EXPECT_NEAR(line.moment.dot(line.direction), 0.0, 1e-15);
    EXPECT_NEAR(line.moment.norm(), line.nearest_to_origin().norm(), 1e-15);
    EXPECT_NEAR(line.moment.norm(), line.distance(Eigen::Vector3d::Zero()), 1e-15);
  }
}

TEST(Line3, the_nearest_point_lies_on_the_line_below_the_point) {
  const Eigen::Vector3d p(0.3, -2.0, 1.7);
  for (const Ends& ends : kSegments) {
    const Line3 line = line_of(ends);
    const Eigen::Vector3d foot = line.nearest_to(p);
    EXPECT_NEAR(line.distance(foot), 0.0, 1e-14);
    EXPECT_NEAR((p - foot).dot(line.direction), 0.0, 1e-14);
    EXPECT_NEAR(line.distance(p), (p - foot).norm(), 1e-14);
    expect_near(line.nearest_to(ends.a), ends.a, 1e-14);
  }
}

TEST(Line3, does_not_exist_for_points_that_coincide) {
  const Eigen::Vector3d p(0.3, -2.0, 1.7);
  EXPECT_FALSE(Line3::through(p, p));
  EXPECT_FALSE(Line3::through(p, p + Eigen::Vector3d(1e-7, 0.0, 0.0)));
  EXPECT_TRUE(Line3::through(p, p + Eigen::Vector3d(1e-5, 0.0, 0.0)));
  EXPECT_FALSE(Line3::through(p, Eigen::Vector3d(std::nan(""), 0.0, 0.0)));
}

TEST(Line3, moves_as_its_points_do) {
  for (const Ends& ends : kSegments) {
    const Line3 moved = kPose * line_of(ends);
    const Line3 expected = *Line3::through(kPose * ends.a, kPose * ends.b);
    expect_near(moved.direction, expected.direction, 1e-14);
    expect_near(moved.moment, expected.moment, 1e-14);
    const Line3 back = kPose.inverse() * moved;
    expect_near(back.moment, line_of(ends).moment, 1e-14);
  }
}

TEST(ProjectLine, is_the_image_line_through_the_projected_points_with_the_same_sign) {
  for (const Ends& ends : kSegments) {
    const auto projected = project_line(kCamera, line_of(ends));
    const auto expected = image_line(kCamera.project(ends.a), kCamera.project(ends.b));
    ASSERT_TRUE(projected && expected);
    // c is some hundred pixels.
    expect_near(*projected, *expected, 1e-10);
    EXPECT_NEAR(projected->head<2>().norm(), 1.0, 1e-15);
  }
}

TEST(ProjectLine, distances_are_positive_on_the_right_of_someone_who_walks_along) {
  // To the right: below. Downwards: on the left of the image.
  const ImageLine right = *project_line(kCamera, *Line3::through({-1.0, 0.0, 2.0}, {1.0, 0.0, 2.0}));
  EXPECT_NEAR(signed_distance(right, {100.0, kCamera.cy + 7.0}), 7.0, 1e-10);
  const ImageLine down = *project_line(kCamera, *Line3::through({0.0, -1.0, 2.0}, {0.0, 1.0, 2.0}));
  EXPECT_NEAR(signed_distance(down, {kCamera.cx - 7.0, 30.0}), 7.0, 1e-10);
}

TEST(ProjectLine, a_line_through_the_camera_centre_has_no_image) {
  EXPECT_FALSE(project_line(kCamera, *Line3::through({0.0, 0.0, 0.0}, {0.1, 0.2, 1.0})));
  EXPECT_FALSE(project_line(kCamera, *Line3::through({0.5e-4, 0.0, 1.0}, {0.5e-4, 0.0, 2.0})));
  EXPECT_TRUE(project_line(kCamera, *Line3::through({2e-4, 0.0, 1.0}, {2e-4, 0.0, 2.0})));
}

TEST(ProjectLine, a_line_in_the_plane_of_the_camera_centre_has_no_image) {
  EXPECT_FALSE(project_line(kCamera, *Line3::through({-1.0, 1.0, 0.0}, {1.0, 1.3, 0.0})));
}

TEST(ProjectLine, numbers_that_are_not_finite_have_no_image) {
  Line3 line;
  line.moment.setConstant(std::nan(""));
  EXPECT_FALSE(project_line(kCamera, line));
}

TEST(ImageLine, passes_through_both_pixels) {
  const Eigen::Vector2d start(10.0, 20.0), end(500.0, 170.0);
  const ImageLine line = *image_line(start, end);
  EXPECT_NEAR(signed_distance(line, start), 0.0, 1e-12);
  EXPECT_NEAR(signed_distance(line, end), 0.0, 1e-12);
  EXPECT_GT(signed_distance(line, {10.0, 40.0}), 0.0);
}

TEST(ImageLine, does_not_exist_for_a_segment_without_length) {
  EXPECT_FALSE(image_line({3.0, 4.0}, {3.0, 4.0}));
  EXPECT_FALSE(image_line({3.0, 4.0}, {3.0, std::nan("")}));
}

TEST(InverseDepth, is_that_of_the_point_that_shows_at_the_pixel) {
  for (const Ends& ends : kSegments)
    for (const double t : {-0.2, 0.0, 0.3, 1.0, 1.1}) {
      const Eigen::Vector3d p = ends.a + t * (ends.b - ends.a);
      if (p.z() < 0.1) continue;
      EXPECT_NEAR(inverse_depth_at(kCamera, line_of(ends), kCamera.project(p)), 1.0 / p.z(), 1e-13);
    }
}

TEST(InverseDepth, is_affine_along_the_image_of_the_line) {
  const Line3 line = line_of(kSegments[4]);
  const Eigen::Vector2d a = kCamera.project(kSegments[4].a), b = kCamera.project(kSegments[4].b);
  const double at_a = inverse_depth_at(kCamera, line, a), at_b = inverse_depth_at(kCamera, line, b);
  for (const double t : {0.25, 0.5, 0.9})
    EXPECT_NEAR(inverse_depth_at(kCamera, line, a + t * (b - a)), at_a + t * (at_b - at_a), 1e-13);
}

TEST(InverseDepth, is_zero_at_the_vanishing_point_and_negative_beyond_it) {
  // A line that runs straight away from the camera vanishes in the principal point.
  const Line3 line = line_of(kSegments[2]);
  const Eigen::Vector2d vanishing(kCamera.cx, kCamera.cy), seen = kCamera.project(kSegments[2].b);
  EXPECT_NEAR(inverse_depth_at(kCamera, line, vanishing), 0.0, 1e-15);
  EXPECT_GT(inverse_depth_at(kCamera, line, seen), 0.0);
  EXPECT_LT(inverse_depth_at(kCamera, line, vanishing - 0.1 * (seen - vanishing)), 0.0);
}

TEST(InverseDepth, is_the_same_all_along_a_line_parallel_to_the_image_plane) {
  const Line3 line = line_of(kSegments[0]);
  for (const double u : {10.0, 300.0, 630.0})
    EXPECT_NEAR(inverse_depth_at(kCamera, line, {u, kCamera.cy + 0.1 * kCamera.fy}), 0.5, 1e-14);
}

TEST(InverseDepth, is_zero_for_a_line_through_the_camera_centre) {
  EXPECT_EQ(inverse_depth_at(kCamera, *Line3::through({0.0, 0.0, 0.0}, {0.1, 0.2, 1.0}), {100.0, 200.0}),
            0.0);
}

}  // namespace
}  // namespace ipl_slam
