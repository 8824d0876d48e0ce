#pragma once

#include <cstddef>
#include <vector>

#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

// The inner loop of the pose optimiser: residuals, robust weights and normal equations of all matches, four
// at a time.

namespace ipl_slam::pose_kernel {

/// Four matches side by side. GCC and Clang map this type to one AVX register or to two SSE2 registers; every
/// operation used is exactly rounded, so both give the same bits.
constexpr std::size_t kLanes = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

/// What the table holds per match.
enum Field : std::size_t {
  kX,             ///< point in the world, m
  kY,             //
  kZ,             //
  kU,             ///< undistorted pixel
  kV,             //
  kInverseDepth,  ///< measured, 1/m
  kPixelInfo,     ///< 1 / variance of u and of v, 1/pixel^2
  kDepthInfo,     ///< 1 / variance of the inverse depth, m^2; 0 = no depth measured
  kHuber,         ///< where Huber's kernel turns linear, standard deviations
  kWeight,        ///< alpha_p; 0 = takes no part
  kChi2,          ///< output of evaluate()
  kFields
};

/// The alignment is spelled out because the compiler of a file without AVX takes 16 bytes to be enough for
/// Lanes.
struct alignas(sizeof(Lanes)) Block {
  Lanes field[kFields];
};

/// The matches in blocks of kLanes; the last block is filled up with zeros, which take no part.
class MatchTable {
 public:
  explicit MatchTable(std::size_t matches) : blocks_((matches + kLanes - 1) / kLanes, Block{}) {}

  [[nodiscard]] std::vector<Block>& blocks() { return blocks_; }
  [[nodiscard]] double get(std::size_t i, Field field) const {
    return blocks_[i / kLanes].field[field][i % kLanes];
  }
  void set(std::size_t i, Field field, double value) { blocks_[i / kLanes].field[field][i % kLanes] = value; }

 private:
  std::vector<Block> blocks_;
};

/// Cost, gradient J^T W e and the upper triangle of J^T W J, row by row.
struct Normal {
  double cost = 0.0;
  double gradient[6] = {};
  double hessian[21] = {};
};

/// Where row <= column of a symmetric 6x6 matrix lies in Normal::hessian.
constexpr int upper(int row, int column) {
  return row * 6 - row * (row - 1) / 2 + column - row;
}

/// Evaluates all matches at T_cw: sums the normal equations, weighted by kWeight and, if `robust`, Huber's
/// kernel, and stores each match's unweighted chi-square (pixels and inverse depth) in kChi2. Runs on AVX2
/// where the processor has it. The order of additions is fixed, four partial sums, so that both versions give
/// the same bits.
void evaluate(const Camera& camera, const SE3& T_cw, bool robust, MatchTable& table, Normal& out);

/// The version for processors without AVX2.
void evaluate_portable(const Camera& camera, const SE3& T_cw, bool robust, MatchTable& table, Normal& out);

}  // namespace ipl_slam::pose_kernel
