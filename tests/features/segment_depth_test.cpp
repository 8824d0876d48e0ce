#include "features/segment_depth.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Plane of the points p of the camera frame with normal . p = 1.
using Plane = Vector3d;

// Through `point`, with the normal given up to its length.
Plane plane_through(const Vector3d& point, const Vector3d& normal) {
  return normal / normal.dot(point);
}

class SegmentDepthTest : public ::testing::Test {
 protected:
  SegmentDepthTest() {
    camera.width = 320;
    camera.height = 240;
    camera.fx = camera.fy = 260.0;
    camera.cx = 159.5;
    camera.cy = 119.5;
  }

  // 1/z of a plane at an undistorted pixel.
  [[nodiscard]] double inverse_at(const Plane& plane, const Vector2d& uv) const {
    return plane.dot(camera.unproject(uv, 1.0));
  }

  // Depth image of what gives 1/z at the undistorted position of a pixel; 0 or less = no depth.
  void draw(const std::function<double(const Vector2d& undistorted)>& inverse_depth) {
    depth.create(camera.height, camera.width, CV_16UC1);
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        const double inverse = inverse_depth(camera.undistort({x, y}));
        depth.at<std::uint16_t>(y, x) =
            inverse > 0.0 ? cv::saturate_cast<std::uint16_t>(camera.depth_scale / inverse) : 0;
      }
    }
  }
  void draw(const Plane& plane) {
    draw([&](const Vector2d& uv) { return inverse_at(plane, uv); });
  }

  // The slanted plane with normal noise that patches of 4 x 4 pixels share.
  void draw_patchy(double sigma, std::uint64_t seed) {
    constexpr int kPatch = 4;
    draw([&](const Vector2d& uv) {
      const auto patch =
          static_cast<std::uint64_t>(uv.x()) / kPatch * 1000 + static_cast<std::uint64_t>(uv.y()) / kPatch;
      return inverse_at(slanted, uv) + sigma * fast_normal_from_bits(hash64(hash64(seed, 5), patch));
    });
  }

  [[nodiscard]] LineSegment segment(const Vector2d& start, const Vector2d& end) const {
    LineSegment result;
    result.start = start.cast<float>();
    result.end = end.cast<float>();
    result.start_pixel = camera.distort(start).cast<float>();
    result.end_pixel = camera.distort(end).cast<float>();
    return result;
  }

  [[nodiscard]] SegmentDepth fit(const LineSegment& segment) const {
    return segment_depth(depth, segment, camera, noise, options);
  }

  void expect_on(const Plane& plane, const LineSegment& segment, double tolerance) const {
    const SegmentDepth found = fit(segment);
    ASSERT_TRUE(found.known());
    EXPECT_NEAR(found.inverse_start, inverse_at(plane, segment.start.cast<double>()), tolerance);
    EXPECT_NEAR(found.inverse_end, inverse_at(plane, segment.end.cast<double>()), tolerance);
  }

  Camera camera;
  DepthNoiseOptions noise;
  SegmentDepthOptions options;
  cv::Mat depth;
  const Plane slanted = plane_through({0, 0, 2}, {0.6, 0.3, 1.0});
  const Plane wall = plane_through({0, 0, 2}, {0, 0, 1});
};

// Depth of 2 m is stored to 0.2 mm, 5e-5 1/m. A sample may lie half a pixel beside the segment, where a
// slanted plane is elsewhere by 6e-4 1/m; over the samples most of that averages out.
constexpr double kExact = 5e-4;

TEST_F(SegmentDepthTest, FindsTheDepthOfALineOnASlantedPlane) {
  draw(slanted);
  expect_on(slanted, segment({60, 50}, {250, 180}), kExact);
  expect_on(slanted, segment({250, 180}, {60, 50}), kExact);
  expect_on(slanted, segment({160, 30}, {160, 200}), kExact);
  expect_on(slanted, segment({100, 100}, {114, 100}), kExact);
}

TEST_F(SegmentDepthTest, FindsItWithNoiseAndAThirdOfOutliers) {
  Random random(4);
  draw([&](const Vector2d& uv) {
    if (random.chance(0.3)) return random.uniform(0.2, 1.5);
    return inverse_at(slanted, uv) + random.normal(0.0, 0.002);
  });
  options.edge_gap = 10.0;  // of seven pixels across, the nearest would nearly always be an outlier
  // 64 samples of 0.002 1/m give each end to 5e-4 1/m; an outlier the tolerance lets in adds as much.
  expect_on(slanted, segment({60, 50}, {250, 180}), 0.002);
  expect_on(slanted, segment({160, 30}, {160, 200}), 0.002);
}

TEST_F(SegmentDepthTest, IgnoresAnObjectInFrontOfAThirdOfTheSegment) {
  draw([&](const Vector2d& uv) { return uv.x() > 120 && uv.x() < 170 ? 1.2 : inverse_at(wall, uv); });
  expect_on(wall, segment({80, 100}, {240, 110}), kExact);
}

// The segment lies where a board 1 m away ends before a wall 2 m away, up to two pixels beside the edge of
// depth.
TEST_F(SegmentDepthTest, TakesTheForegroundOnADepthEdge) {
  const Plane board = plane_through({0, 0, 1}, {0.2, -0.3, 1.0});
  for (const bool board_on_the_left : {true, false}) {
    draw([&](const Vector2d& uv) {
      return inverse_at((uv.x() < 160) == board_on_the_left ? board : wall, uv);
    });
    for (const double off : {-2.0, -0.5, 0.0, 1.0, 2.0}) {
      // Two pixels aside the board is elsewhere by 2 x 0.2 / 260 = 0.0015 1/m.
      expect_on(board, segment({160 + off, 40}, {160 + off, 200}), 0.0025);
      expect_on(board, segment({160 + off, 200}, {160 + off, 40}), 0.0025);
    }
  }
  draw([&](const Vector2d& uv) { return inverse_at(uv.y() < 100 ? wall : board, uv); });
  expect_on(board, segment({40, 99}, {250, 99}), 0.0025);
}

TEST_F(SegmentDepthTest, StaysOnTheWallBesideAnEdgeFartherOff) {
  draw([&](const Vector2d& uv) { return uv.x() < 150 ? 1.0 : inverse_at(wall, uv); });
  expect_on(wall, segment({155, 40}, {155, 200}), kExact);
}

TEST_F(SegmentDepthTest, BridgesSamplesWithoutDepth) {
  draw([&](const Vector2d& uv) {
    return static_cast<int>(uv.y()) / 10 % 2 == 0 ? 0.0 : inverse_at(slanted, uv);
  });
  expect_on(slanted, segment({160, 30}, {160, 210}), kExact);
}

TEST_F(SegmentDepthTest, IsNotKnownWithoutDepth) {
  const LineSegment line = segment({60, 50}, {250, 180});
  EXPECT_FALSE(fit(line).known());  // no depth image
  depth = cv::Mat::zeros(camera.height, camera.width, CV_16UC1);
  const SegmentDepth found = fit(line);
  EXPECT_EQ(found.inverse_start, 0.0F);
  EXPECT_EQ(found.inverse_end, 0.0F);
  EXPECT_TRUE(found.covariance.isZero());
}

TEST_F(SegmentDepthTest, IsNotKnownBeyondTheTrustedRange) {
  draw(wall);
  noise.max_depth = 1.9;
  EXPECT_FALSE(fit(segment({60, 50}, {250, 180})).known());
  noise.max_depth = 2.1;
  EXPECT_TRUE(fit(segment({60, 50}, {250, 180})).known());
  // The part within range gives the line, but its end lies beyond.
  const Plane receding = plane_through({0, 0, 2}, {1.0, 0, 1.0});
  draw(receding);
  EXPECT_FALSE(fit(segment({110, 120}, {260, 120})).known());
}

TEST_F(SegmentDepthTest, IsNotKnownWhereDepthCoversASmallPartOnly) {
  draw([&](const Vector2d& uv) { return uv.x() < 145 ? inverse_at(slanted, uv) : 0.0; });
  const LineSegment line = segment({60, 100}, {260, 100});  // 42 % of it
  EXPECT_FALSE(fit(line).known());
  options.min_span = 0.35;
  EXPECT_TRUE(fit(line).known());
  options.min_support = 0.5;
  EXPECT_FALSE(fit(line).known());
}

TEST_F(SegmentDepthTest, IsNotKnownWhereNothingAgrees) {
  Random random(7);
  draw([&](const Vector2d&) { return random.uniform(0.2, 2.0); });
  for (int i = 0; i < 50; ++i) {
    const Vector2d start(random.uniform(20, 300), random.uniform(20, 220));
    const Vector2d end(random.uniform(20, 300), random.uniform(20, 220));
    EXPECT_FALSE(fit(segment(start, end)).known());
  }
}

TEST_F(SegmentDepthTest, IsNotKnownForAPointOrAHandfulOfPixels) {
  draw(wall);
  EXPECT_FALSE(fit(segment({160, 120}, {160, 120})).known());
  EXPECT_FALSE(fit(segment({160, 120}, {165, 120})).known());
}

TEST_F(SegmentDepthTest, IsDefinedAtTheImageBorder) {
  draw(slanted);
  expect_on(slanted, segment({0, 0}, {319, 0}), kExact);
  expect_on(slanted, segment({319, 239}, {319, 0}), kExact);
  // A fifth of it outside: the line is known well enough beyond.
  expect_on(slanted, segment({-40, 100}, {160, 100}), 2 * kExact);
  EXPECT_FALSE(fit(segment({-40, -20}, {360, -20})).known());
  EXPECT_FALSE(fit(segment({NAN, 10}, {100, 10})).known());
}

// From 0.7 m to 2.4 m within 60 pixels, as on the floor of a corridor: 1/z falls by 0.017 1/m a pixel, a
// pixel rounded to its neighbour would be off by half of that.
TEST_F(SegmentDepthTest, FollowsALineThatRunsAwayFromTheCamera) {
  const LineSegment line = segment({130.3, 200.2}, {150.1, 142.7});
  const Plane floor = plane_through({0, 0.22, 0.71}, {0, 1, 0.0});
  draw(floor);
  ASSERT_GT(inverse_at(floor, line.start.cast<double>()), 1.3);
  ASSERT_LT(inverse_at(floor, line.end.cast<double>()), 0.42);
  expect_on(floor, line, 3e-3);  // up to half a pixel aside, the floor is elsewhere by 0.006 1/m
}

TEST_F(SegmentDepthTest, ReadsDepthWhereTheDistortedEdgeLies) {
  // TUM fr1's: near the border the image of a straight line bends by pixels.
  camera.width = 640, camera.height = 480;
  camera.fx = 517.306, camera.fy = 516.469, camera.cx = 318.643, camera.cy = 255.314;
  camera.k1 = 0.262383, camera.k2 = -0.953104, camera.p1 = -0.005358, camera.p2 = 0.002628;
  camera.k3 = 1.163314;
  const Vector2d start(20, 24), end(620, 24);
  const Vector2d bend = camera.distort({320, 24}) - 0.5 * (camera.distort(start) + camera.distort(end));
  ASSERT_GT(bend.norm(), 3.5);
  // A straight edge of a board before a wall: reading along the chord would miss the board.
  const Plane board = plane_through({0, 0, 1.5}, {0.3, 0, 1.0});
  draw([&](const Vector2d& uv) { return inverse_at(uv.y() < 24 ? board : wall, uv); });
  expect_on(board, segment(start, end), 0.001);
  // Along the segment the positions are stretched too.
  draw(slanted);
  expect_on(slanted, segment(start, end), kExact);
  expect_on(slanted, segment({40, 40}, {300, 220}), kExact);
}

// Errors over many draws against the covariance that comes with them. Noise like a depth camera's: patches of
// 4 x 4 pixels share their error.
TEST_F(SegmentDepthTest, ItsCovarianceIsHonest) {
  struct Case {
    LineSegment line;
    const char* name;
  };
  const Case cases[] = {{segment({60, 60}, {240, 170}), "long"},
                        {segment({100, 100}, {100, 160}), "middling"},
                        {segment({200, 90}, {230, 90}), "short"}};
  constexpr double kSigma = 0.0025;
  constexpr int kDraws = 400;
  for (const Case& c : cases) {
    double sum = 0.0, far_out = 0.0;
    for (int i = 0; i < kDraws; ++i) {
      draw_patchy(kSigma, i);
      const SegmentDepth found = fit(c.line);
      ASSERT_TRUE(found.known()) << c.name;
      const Vector2d error(found.inverse_start - inverse_at(slanted, c.line.start.cast<double>()),
                           found.inverse_end - inverse_at(slanted, c.line.end.cast<double>()));
      const double chi2 = error.dot(found.covariance.cast<double>().inverse() * error);
      sum += chi2;
      far_out += chi2 > 9.21;  // 1 % of a chi-square of two degrees of freedom
    }
    // 2 would be exact. Too modest by up to 4 (the floor) is safe; too sure by more than 1.5 is not.
    EXPECT_GT(sum / kDraws, 0.5) << c.name;
    EXPECT_LT(sum / kDraws, 3.0) << c.name;
    EXPECT_LT(far_out / kDraws, 0.06) << c.name;
  }
}

TEST_F(SegmentDepthTest, GrowsUncertainWithNoiseAndSureWithLength) {
  const LineSegment line = segment({100, 100}, {160, 100});
  const LineSegment longer = segment({60, 100}, {240, 100});
  draw(wall);
  const double floor = options.resolution * options.resolution;
  EXPECT_NEAR(fit(line).covariance(0, 0), floor, 1e-3 * floor);
  draw_patchy(0.003, 1);
  EXPECT_GT(fit(line).covariance(0, 0), 1.5 * floor);
  EXPECT_LT(fit(longer).covariance(0, 0), fit(line).covariance(0, 0));
}

}  // namespace
}  // namespace ipl_slam
