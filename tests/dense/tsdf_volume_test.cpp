#include "dense/tsdf_volume.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

// A quarter of the usual size: quick, and views of 64 cm at 1 m.
Camera small_camera() {
  Camera camera;
  camera.width = 160, camera.height = 120;
  camera.fx = camera.fy = 131.25;
  camera.cx = 79.5, camera.cy = 59.5;
  return camera;
}

// Depths are set one by one, incidence is that of surfaces across the optical axis.
struct Picture {
  RangeImage range{cv::Mat::zeros(120, 160, CV_32FC1), cv::Mat::zeros(120, 160, CV_32FC1),
                   cv::Mat::zeros(120, 160, CV_32FC1)};

  Picture& rectangle(const cv::Rect& where, double depth) {
    range.depth(where).setTo(depth);
    range.incidence(where).setTo(1.0);
    range.reach(where).setTo(depth);
    return *this;
  }
  Picture& leave_out(const cv::Rect& where) {
    range.depth(where).setTo(0.0);
    range.incidence(where).setTo(0.0);
    return *this;
  }
  Picture& forget(const cv::Rect& where) {
    range.reach(where).setTo(0.0);
    return leave_out(where);
  }
};

const cv::Rect kWhole(0, 0, 160, 120);

RangeImage wall(double depth) {
  return Picture().rectangle(kWhole, depth).range;
}

struct Voxel {
  double distance = 0.0;  // mean, m
  int weight = 0, free = 0;
};

Voxel voxel_at(const TsdfVolume& volume, const Eigen::Vector3d& point_w) {
  const VoxelCoord v = volume.grid().voxel_of(point_w);
  const VoxelBlock* block = volume.grid().find(VoxelGrid::block_of(v));
  if (block == nullptr) return {};
  const std::size_t i = VoxelGrid::index_in_block(v);
  Voxel voxel{0.0, block->weight[i], block->free[i]};
  if (voxel.weight > 0) {
    voxel.distance =
        VolumeOptions().truncation / VoxelBlock::kDistanceSteps * block->distance[i] / block->weight[i];
  }
  return voxel;
}

// Depth at which the distance is 0 along the optical axis, between the two voxels about it.
double zero_crossing(const TsdfVolume& volume, double from, double to) {
  const double step = volume.grid().voxel_size();
  for (double z = from; z < to; z += step) {
    const Voxel near = voxel_at(volume, {0.0, 0.0, z}), far = voxel_at(volume, {0.0, 0.0, z + step});
    if (near.weight == 0 || far.weight == 0 || near.distance < 0.0 || far.distance >= 0.0) continue;
    const double centre = volume.grid().centre(volume.grid().voxel_of({0.0, 0.0, z})).z();
    return centre + step * near.distance / (near.distance - far.distance);
  }
  return 0.0;
}

bool same(const VoxelBlock& a, const VoxelBlock& b) {
  return a.distance == b.distance && a.weight == b.weight && a.free == b.free && a.claims == b.claims;
}

::testing::AssertionResult same_content(const VoxelGrid& a, const VoxelGrid& b) {
  if (a.sorted() != b.sorted()) {
    return ::testing::AssertionFailure() << a.blocks().size() << " blocks and " << b.blocks().size();
  }
  for (const BlockCoord& place : a.sorted()) {
    if (same(*a.find(place), *b.find(place))) continue;
    return ::testing::AssertionFailure() << "block " << place.x << " " << place.y << " " << place.z;
  }
  return ::testing::AssertionSuccess();
}

// Views that differ in all a view can differ in: slanted surfaces, things before them, holes, masks.
RangeImage random_range(Random& random) {
  Picture picture;
  const double depth = random.uniform(0.6, 1.4), slope = random.uniform(-0.4, 0.4);
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      const auto z = static_cast<float>(depth / (1.0 + slope * (u - 79.5) / 131.25));
      picture.range.depth.at<float>(v, u) = picture.range.reach.at<float>(v, u) = z;
      picture.range.incidence.at<float>(v, u) =
          static_cast<float>(depth / z / std::sqrt(1.0 + slope * slope));
    }
  }
  const auto somewhere = [&random] {
    return cv::Rect(static_cast<int>(random.uniform(0, 110)), static_cast<int>(random.uniform(0, 80)), 40,
                    30);
  };
  picture.rectangle(somewhere(), random.uniform(0.3, 0.6));
  picture.leave_out(somewhere());
  picture.forget(somewhere());
  return picture.range;
}

SE3 random_pose(Random& random) {
  Vector6d twist;
  for (int i = 0; i < 6; ++i) twist[i] = random.uniform(-0.25, 0.25);
  return SE3::exp(twist);
}

TEST(TsdfVolume, HasItsZeroWhereAWallIs) {
  for (const double depth : {0.8, 1.2345, 2.0}) {
    TsdfVolume volume(small_camera(), {});
    static_cast<void>(volume.add(wall(depth), SE3()));
    // A step is 0.04 mm, and floats of 2 m end at 0.2 micrometres.
    EXPECT_NEAR(zero_crossing(volume, depth - 0.05, depth + 0.05), depth, 0.00005);
  }
}

TEST(TsdfVolume, MeasuresTheDistanceAcrossASlantedSurface) {
  // n . p = d, 50 degrees off the optical axis.
  const Eigen::Vector3d n(std::sin(0.87), 0.0, std::cos(0.87));
  const double d = 0.8;
  const Camera camera = small_camera();
  RangeImage range = wall(1.0);
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      const double along = n.dot(camera.unproject({u, v}, 1.0));
      range.depth.at<float>(v, u) = range.reach.at<float>(v, u) = static_cast<float>(d / along);
      range.incidence.at<float>(v, u) = static_cast<float>(along);
    }
  }
  TsdfVolume volume(camera, {});
  static_cast<void>(volume.add(range, SE3()));
  int measured = 0;
  for (double offset = -0.035; offset <= 0.035; offset += 0.005) {
    const Eigen::Vector3d point =
        camera.unproject({90.0, 50.0}, 1.0) * (d + offset) / n.dot(camera.unproject({90.0, 50.0}, 1.0));
    const Eigen::Vector3d centre = volume.grid().centre(volume.grid().voxel_of(point));
    const Voxel voxel = voxel_at(volume, point);
    if (voxel.weight == 0) continue;
    ++measured;
    // A ray goes by the voxel's centre up to half a pixel off, 5 mm, but it was told the plane.
    EXPECT_NEAR(voxel.distance, d - n.dot(centre), 0.006);
  }
  EXPECT_GE(measured, 10);
}

TEST(TsdfVolume, KnowsDistancesUpToTheTruncationOnBothSides) {
  TsdfVolume volume(small_camera(), {});
  static_cast<void>(volume.add(wall(1.005), SE3()));
  for (int i = -3; i <= 3; ++i) {
    const Voxel voxel = voxel_at(volume, {0.0, 0.0, 1.005 + 0.01 * i});
    ASSERT_GT(voxel.weight, 0) << i;
    EXPECT_NEAR(voxel.distance, -0.01 * i, 0.0001) << i;
  }
  EXPECT_EQ(voxel_at(volume, {0.0, 0.0, 1.055}).weight, 0);
  EXPECT_EQ(voxel_at(volume, {0.0, 0.0, 0.955}).weight, 0);
}

TEST(TsdfVolume, AveragesViewsByTheirWeight) {
  VolumeOptions options;
  TsdfVolume volume(small_camera(), options);
  // The second camera is 1 m behind the first, and its error of depth more than twice that of the pose.
  const SE3 T_cw(Eigen::Quaterniond::Identity(), {0.0, 0.0, 1.0});
  static_cast<void>(volume.add(wall(1.0), SE3()));
  const int near = voxel_at(volume, {0.0, 0.0, 0.995}).weight;
  static_cast<void>(volume.add(wall(2.02), T_cw));
  const int far = voxel_at(volume, {0.0, 0.0, 0.995}).weight - near;
  // 16 s^2 / (s^2 + (0.0014 z^2)^2) with s = 0.005.
  EXPECT_EQ(near, 15);
  EXPECT_EQ(far, 7);
  EXPECT_NEAR(zero_crossing(volume, 0.9, 1.1), 1.0 + 0.02 * far / (near + far), 0.00005);
}

TEST(TsdfVolume, GivesSurfacesSeenFlatLessWeight) {
  RangeImage flat = wall(1.0);
  flat.incidence.setTo(0.4);
  TsdfVolume volume(small_camera(), {});
  static_cast<void>(volume.add(flat, SE3()));
  EXPECT_EQ(voxel_at(volume, {0.0, 0.0, 0.995}).weight, 6);
}

TEST(TsdfVolume, LooksThroughWhatStoodThereAndLeft) {
  const SE3 beside(Eigen::Quaterniond::Identity(), {-0.05, 0.0, 0.0});
  const RangeImage room = wall(2.0);
  const RangeImage with_someone = Picture().rectangle(kWhole, 2.0).rectangle({50, 30, 60, 60}, 1.5).range;
  TsdfVolume volume(small_camera(), {});
  for (int i = 0; i < 3; ++i) static_cast<void>(volume.add(with_someone, SE3()));
  const Voxel then = voxel_at(volume, {0.0, 0.0, 1.505});
  EXPECT_GT(then.weight, 0);
  EXPECT_EQ(then.free, 0);
  for (int i = 0; i < 6; ++i) static_cast<void>(volume.add(room, i % 2 == 0 ? SE3() : beside));
  for (double x = -0.25; x <= 0.25; x += 0.05) {
    const Voxel ghost = voxel_at(volume, {x, 0.0, 1.505});
    EXPECT_GT(ghost.weight, 0) << x;
    EXPECT_GT(ghost.free, ghost.weight) << x;
  }
  // The wall behind, also where the person hid it for a while.
  for (double x = -0.5; x <= 0.5; x += 0.05) {
    for (const double z : {1.965, 1.985, 2.005, 2.025}) {
      EXPECT_GT(voxel_at(volume, {x, 0.0, z}).weight, 0) << x << " " << z;
      EXPECT_EQ(voxel_at(volume, {x, 0.0, z}).free, 0) << x << " " << z;
    }
  }
}

TEST(TsdfVolume, DoesNotLookThroughTheSurfaceThatItSeesFlat) {
  // A floor 0.5 m below a level camera: along the ray, 4 cm above the floor are 16 cm at 2 m.
  const Camera camera = small_camera();
  RangeImage floor = Picture().range;
  for (int v = 75; v < 120; ++v) {
    const double z = 0.5 / camera.unproject({0, v}, 1.0).y();
    floor.depth.row(v).setTo(z);
    floor.reach.row(v).setTo(z);
    floor.incidence.row(v).setTo(0.5 / z);
  }
  TsdfVolume volume(camera, {});
  static_cast<void>(volume.add(floor, SE3()));
  EXPECT_GT(voxel_at(volume, {0.0, 0.505, 2.0}).weight, 0);
  for (double z = 1.2; z < 3.0; z += 0.1) {
    for (const double y : {0.475, 0.485, 0.495, 0.505}) {
      EXPECT_EQ(voxel_at(volume, {0.0, y, z}).free, 0) << y << " " << z;
    }
  }
}

TEST(TsdfVolume, SeesNoSurfaceInWhatIsLeftOutButLooksThroughWhatIsBeforeIt) {
  TsdfVolume volume(small_camera(), {});
  static_cast<void>(volume.add(wall(1.0), SE3()));
  const Voxel before = voxel_at(volume, {0.0, 0.0, 1.005});
  const RangeImage someone = Picture().rectangle(kWhole, 1.5).leave_out(kWhole).range;
  static_cast<void>(volume.add(someone, SE3()));
  const Voxel after = voxel_at(volume, {0.0, 0.0, 1.005});
  EXPECT_EQ(after.weight, before.weight);
  EXPECT_GT(after.free, 0);
  EXPECT_EQ(volume.grid().find(VoxelGrid::block_of(volume.grid().voxel_of({0.0, 0.0, 1.505}))), nullptr);
}

TEST(TsdfVolume, LearnsNothingFromPixelsWithoutDepth) {
  TsdfVolume volume(small_camera(), {}), other(small_camera(), {});
  static_cast<void>(volume.add(wall(1.0), SE3()));
  static_cast<void>(other.add(wall(1.0), SE3()));
  static_cast<void>(volume.add(Picture().range, SE3()));
  EXPECT_TRUE(same_content(volume.grid(), other.grid()));
}

TEST(TsdfVolume, LooksThroughNothingNearItsReach) {
  TsdfVolume volume(small_camera(), {});
  static_cast<void>(volume.add(wall(1.005), SE3()));
  // At 3 m three times the error of depth are 3.8 cm: the truncation counts. At 4 m they are 6.7 cm.
  for (const auto& [reach, margin] : {std::pair{3.0, 0.04}, {4.0, 0.0672}}) {
    const double back = reach - margin - 1.005;  // z of the world's 1.005 m is `reach - margin` there
    for (const double gap : {-0.002, 0.002}) {
      TsdfVolume one(small_camera(), {});
      static_cast<void>(one.add(wall(1.005), SE3()));
      const SE3 T_cw(Eigen::Quaterniond::Identity(), {0.0, 0.0, back + gap});
      static_cast<void>(one.add(Picture().rectangle(kWhole, reach).leave_out(kWhole).range, T_cw));
      EXPECT_EQ(voxel_at(one, {0.0, 0.0, 1.005}).free > 0, gap < 0.0) << reach << " " << gap;
    }
  }
}

TEST(TsdfVolume, IsTheSameWhateverItsHistory) {
  Random random(7);
  std::vector<RangeImage> ranges;
  for (int i = 0; i < 8; ++i) ranges.push_back(random_range(random));
  struct Placed {
    SE3 T_cw;
    TsdfVolume::Moment since = 0;
    bool there = false;
  };
  for (int trial = 0; trial < 5; ++trial) {
    TsdfVolume volume(small_camera(), {});
    std::vector<Placed> views(ranges.size());
    for (int step = 0; step < 40; ++step) {
      const auto i = static_cast<std::size_t>(random.uniform(0.0, 7.999));
      Placed& view = views[i];
      if (view.there && random.uniform(0.0, 1.0) < 0.3) {
        view.since = volume.catch_up(ranges[i], view.T_cw, view.since);
      } else if (view.there) {
        volume.remove(ranges[i], view.T_cw, view.since);
        view.there = false;
      } else {
        view = {random_pose(random), 0, true};
        view.since = volume.add(ranges[i], view.T_cw);
      }
    }
    TsdfVolume fresh(small_camera(), {});
    std::vector<TsdfVolume::Moment> since(ranges.size());
    for (std::size_t i = ranges.size(); i-- > 0;) {
      if (views[i].there) since[i] = fresh.add(ranges[i], views[i].T_cw);
    }
    bool was_behind = false;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      if (!views[i].there) continue;
      was_behind = was_behind || !volume.is_up_to_date(views[i].since);
      views[i].since = volume.catch_up(ranges[i], views[i].T_cw, views[i].since);
      EXPECT_TRUE(volume.is_up_to_date(views[i].since));
      static_cast<void>(fresh.catch_up(ranges[i], views[i].T_cw, since[i]));
    }
    EXPECT_TRUE(was_behind);
    EXPECT_GT(volume.grid().blocks().size(), 100U);
    EXPECT_TRUE(same_content(volume.grid(), fresh.grid()));
    // And nothing is left when all is taken out.
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      if (views[i].there) volume.remove(ranges[i], views[i].T_cw, views[i].since);
    }
    EXPECT_TRUE(volume.grid().blocks().empty());
  }
}

TEST(TsdfVolume, TakesABlockThatWasMadeAnewForANewOne) {
  // A poster that only the second view sees is taken out and comes back: the first view has looked through
  // the old blocks there, not through the new ones.
  const RangeImage room = wall(2.0);
  const RangeImage poster = Picture().rectangle({60, 40, 40, 40}, 1.5).range;
  TsdfVolume volume(small_camera(), {});
  TsdfVolume::Moment first = volume.add(room, SE3());
  const TsdfVolume::Moment second = volume.add(poster, SE3());
  first = volume.catch_up(room, SE3(), first);
  const int free = voxel_at(volume, {0.0, 0.0, 1.505}).free;
  EXPECT_GT(free, 0);
  volume.remove(poster, SE3(), second);
  EXPECT_TRUE(volume.is_up_to_date(first));
  static_cast<void>(volume.add(poster, SE3()));
  EXPECT_FALSE(volume.is_up_to_date(first));
  EXPECT_EQ(voxel_at(volume, {0.0, 0.0, 1.505}).free, 0);
  first = volume.catch_up(room, SE3(), first);
  EXPECT_EQ(voxel_at(volume, {0.0, 0.0, 1.505}).free, free);
}

TEST(TsdfVolume, GivesTheSameBitsWithEitherBody) {
  if (best_simd() == Simd::portable) GTEST_SKIP() << "this processor has no AVX2";
  Random random(3);
  TsdfVolume portable(small_camera(), {}, Simd::portable), wide(small_camera(), {}, best_simd());
  std::vector<RangeImage> ranges;
  std::vector<SE3> poses;
  for (int i = 0; i < 6; ++i) {
    ranges.push_back(random_range(random));
    poses.push_back(random_pose(random));
    static_cast<void>(portable.add(ranges.back(), poses.back()));
    static_cast<void>(wide.add(ranges.back(), poses.back()));
  }
  ASSERT_TRUE(same_content(portable.grid(), wide.grid()));
  portable.remove(ranges[2], poses[2], 3);
  wide.remove(ranges[2], poses[2], 3);
  EXPECT_TRUE(same_content(portable.grid(), wide.grid()));
}

TEST(TsdfVolume, EndsItsSumsWithoutWrapping) {
  for (const Simd simd : {Simd::portable, best_simd()}) {
    Camera camera;  // few pixels: quick
    camera.width = camera.height = 16;
    camera.fx = camera.fy = 100.0;
    camera.cx = camera.cy = 7.5;
    TsdfVolume volume(camera, {}, simd);
    const cv::Size size(16, 16);
    const auto filled = [size](double value) { return cv::Mat(size, CV_32FC1, cv::Scalar(value)); };
    const RangeImage patch{filled(0.505), filled(1.0), filled(0.505)};
    const RangeImage behind{filled(0.0), filled(0.0), filled(0.9)};
    for (int i = 0; i < 4200; ++i) {
      static_cast<void>(volume.add(patch, SE3()));
      static_cast<void>(volume.add(behind, SE3()));
    }
    Voxel voxel = voxel_at(volume, {0.0, 0.0, 0.515});
    EXPECT_EQ(voxel.weight, 65535);
    EXPECT_EQ(voxel.free, 65535);
    EXPECT_NEAR(voxel.distance, -0.01, 0.0001);
    const TsdfVolume::Moment last = volume.add(patch, SE3());
    for (int i = 0; i < 4200; ++i) {
      volume.remove(patch, SE3(), last);
      volume.remove(behind, SE3(), last);
    }
    voxel = voxel_at(volume, {0.0, 0.0, 0.515});
    EXPECT_EQ(voxel.weight, 0);
    EXPECT_EQ(voxel.free, 0);
    EXPECT_EQ(voxel.distance, 0.0);
    volume.remove(patch, SE3(), last);
    EXPECT_TRUE(volume.grid().blocks().empty());
  }
}

TEST(TsdfVolume, StaysWithinItsMemoryAndSaysWhatItRefused) {
  VolumeOptions options;
  options.max_memory = 16;
  options.voxel = 0.002;
  options.truncation = 0.01;
  TsdfVolume volume(small_camera(), options);
  const RangeImage view = wall(1.0);
  const TsdfVolume::Moment first = volume.add(view, SE3());
  EXPECT_GT(volume.refused(), 0U);
  EXPECT_LE(volume.grid().bytes(), 16U << 20U);
  EXPECT_GT(volume.grid().bytes(), 15U << 20U);

  // A second view has its surface in blocks of the first and in some there is no room for. When the first is
  // taken out there is room, and a third view takes it.
  const RangeImage second_view = Picture().rectangle({0, 40, 160, 60}, 1.0).range;
  TsdfVolume::Moment second = volume.add(second_view, SE3());
  volume.remove(view, SE3(), first);
  const RangeImage third_view = Picture().rectangle({0, 45, 160, 30}, 1.0).range;
  const TsdfVolume::Moment third = volume.add(third_view, SE3());
  second = volume.catch_up(second_view, SE3(), second);
  // Whoever goes first, the other's blocks stay, and at the end nothing is left.
  TsdfVolume alone(small_camera(), options);
  EXPECT_GT(volume.grid().blocks().size(), 1000U);
  static_cast<void>(alone.add(third_view, SE3()));
  ASSERT_EQ(alone.refused(), 0U);
  volume.remove(second_view, SE3(), second);
  EXPECT_TRUE(same_content(volume.grid(), alone.grid()));
  volume.remove(third_view, SE3(), third);
  EXPECT_TRUE(volume.grid().blocks().empty());
}

TEST(TsdfVolume, MissesNoBlockThatASurfaceCrosses) {
  // A wall turned by 35 degrees about an oblique axis, so that it cuts blocks in all ways.
  const Camera camera;
  const Eigen::Vector3d n = Eigen::Vector3d(0.4, -0.35, 0.85).normalized();
  RangeImage range{cv::Mat(480, 640, CV_32FC1), cv::Mat(480, 640, CV_32FC1),
                   cv::Mat::zeros(480, 640, CV_32FC1)};
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const double along = n.dot(camera.unproject({u, v}, 1.0));
      range.depth.at<float>(v, u) = static_cast<float>(1.8 / along);
      range.incidence.at<float>(v, u) = static_cast<float>(along);
    }
  }
  TsdfVolume volume(camera, {});
  static_cast<void>(volume.add(range, SE3()));
  int missed = 0, all = 0;
  for (int v = 2; v < 478; ++v) {
    for (int u = 2; u < 638; ++u) {
      const Eigen::Vector3d point = camera.unproject({u, v}, range.depth.at<float>(v, u));
      ++all;
      if (voxel_at(volume, point).weight == 0) ++missed;
    }
  }
  EXPECT_LE(missed, all / 10000);
}

TEST(TsdfVolume, RefusesImagesOfAnotherSize) {
  TsdfVolume volume(Camera(), {});
  EXPECT_THROW(static_cast<void>(volume.add(wall(1.0), SE3())), cv::Exception);
}

}  // namespace
}  // namespace ipl_slam
