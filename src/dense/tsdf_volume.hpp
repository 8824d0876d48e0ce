#pragma once

#include <cstddef>
#include <cstdint>

#include "common/cpu.hpp"
#include "common/options.hpp"
#include "dense/range_image.hpp"
#include "dense/voxel_grid.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

struct VolumeOptions {
  double voxel = 0.01;       ///< m
  double truncation = 0.04;  ///< m
  /// m. With depth_sigma it makes views from 2 m count half, from 3 m a seventh of the nearest.
  double pose_sigma = 0.005;
  /// 1/m. (Tracking trusts depth less: see DepthNoiseOptions.)
  double depth_sigma = kStructuredLightSigma;
  int max_memory = 4096;  ///< MiB

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("voxel", voxel, {0.002, 1.0, "m", "edge of a voxel"});
    v.number("truncation", truncation,
             {0.004, 4.0, "m", "distances to a surface are known up to this, before and behind it"});
    v.number("pose_sigma", pose_sigma,
             {0.0, 1.0, "m",
              "error of a surface point that the camera's pose makes, beside that of its depth: views from "
              "near count no more than this allows"});
    v.number("depth_sigma", depth_sigma,
             {1e-5, 1.0, "1/m", "error of measured depth at 1 m; it grows with the square of depth"});
    v.number("max_memory", max_memory,
             {16, 1048576, "MiB", "no voxels are added beyond this; the run goes on and says so"});
  }
};

/// Signed distances to the surfaces that views of known pose show (Curless and Levoy, "A volumetric method
/// for building complex models from range images", SIGGRAPH 1996), and how often a place was looked through.
///
/// The state depends on the views that are in it and their poses alone, once every view was brought up to
/// date by catch_up(): not on their order, nor on what was in it before. (A voxel's sums end at 65535; a view
/// weighs 16 at most, so this holds for 4095 views of one place.) Where max_memory left no room for a block,
/// the order of views decides which blocks there are.
///
/// A block exists as long as a view has its surface there. A view weighs by the error of its depth and of its
/// pose, and by the angle at which it sees the surface. A voxel is looked through by a view whose rays go on
/// behind it, by more than the truncation and three times the error of depth, and whose own surface is not
/// within the truncation.
class TsdfVolume {
 public:
  /// A view's contribution at one moment. Blocks that were born later do not have it.
  using Moment = std::uint32_t;

  /// camera: its distortion does not count.
  TsdfVolume(const Camera& camera, const VolumeOptions& options, Simd simd = best_simd());

  /// Takes a view in.
  [[nodiscard]] Moment add(const RangeImage& view, const SE3& T_cw);
  /// Takes a view out as it was taken in: the same image and pose, and the moment of the last add() or
  /// catch_up().
  void remove(const RangeImage& view, const SE3& T_cw, Moment since);
  /// Adds what the view says of blocks that came into being since.
  [[nodiscard]] Moment catch_up(const RangeImage& view, const SE3& T_cw, Moment since);
  /// Whether catch_up() would have anything to do.
  [[nodiscard]] bool is_up_to_date(Moment since) const { return since == clock_; }

  [[nodiscard]] const VoxelGrid& grid() const { return grid_; }
  /// Blocks that max_memory left no room for, counted once per view.
  [[nodiscard]] std::size_t refused() const { return refused_; }

 private:
  [[nodiscard]] bool is_full() const;

  Camera camera_;
  VolumeOptions options_;
  Simd simd_;
  VoxelGrid grid_;
  Moment clock_ = 0;
  std::size_t refused_ = 0;
};

}  // namespace ipl_slam
