#pragma once

#include <array>
#include <cstddef>
#include <vector>

// What the inner loops of the pose optimiser share: four matches side by side, tables of them, and the sums
// of the normal equations.

namespace ipl_slam::pose_kernel {

/// Four matches side by side. GCC and Clang map this type to one AVX register or to two SSE2 registers; every
/// operation used is exactly rounded, so both give the same bits.
constexpr std::size_t kLanes = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using Mask = decltype(Lanes{} < Lanes{});

/// Matches in blocks of kLanes, `Fields` numbers each, of which `Field` is the enumeration; the last block is
/// filled up with zeros, which take no part.
template <class Field, std::size_t Fields>
class LaneTable {
 public:
  /// The alignment is spelled out because the compiler of a file without AVX takes 16 bytes to be enough for
  /// Lanes.
  struct alignas(sizeof(Lanes)) Block {
    Lanes field[Fields];
  };

  explicit LaneTable(std::size_t matches) : blocks_((matches + kLanes - 1) / kLanes, Block{}) {}

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

/// Four partial sums of Normal, one per lane. The order of additions is fixed.
struct LaneSums {
  Lanes cost{}, gradient[6]{}, hessian[21]{};

  /// Adds weight * row^T * (row, e), touching only the columns that can differ from zero.
  template <std::size_t N>
  [[gnu::always_inline]] void add_row(const std::array<int, N>& columns, const Lanes (&row)[6],
                                      const Lanes& e, const Lanes& weight) {
#pragma GCC unroll 6
    for (std::size_t r = 0; r < N; ++r) {
      const Lanes weighted = weight * row[columns[r]];
      gradient[columns[r]] += weighted * e;
#pragma GCC unroll 6
      for (std::size_t c = r; c < N; ++c)
        hessian[upper(columns[r], columns[c])] += weighted * row[columns[c]];
    }
  }

  [[gnu::always_inline]] void add_to(Normal& out) const {
    const auto sum = [](const Lanes& v) __attribute__((always_inline)) {
      return (v[0] + v[1]) + (v[2] + v[3]);
    };
    out.cost += sum(cost);
    for (int i = 0; i < 6; ++i) out.gradient[i] += sum(gradient[i]);
    for (int i = 0; i < 21; ++i) out.hessian[i] += sum(hessian[i]);
  }
};

[[gnu::always_inline]] inline void square_root(Lanes& v) {
  for (std::size_t l = 0; l < kLanes; ++l) v[l] = __builtin_sqrt(v[l]);
}

/// rho(s) and rho'(s) of Huber's kernel, as in robust.hpp: turns `loss` from s into rho(s) and multiplies
/// `weight` by rho'(s).
[[gnu::always_inline]] inline void apply_huber(const Lanes& delta, Lanes& loss, Lanes& weight) {
  const Lanes one = Lanes{} + 1.0, inside = delta * delta, s = loss;
  Lanes root = s > inside ? s : one;
  square_root(root);
  loss = s > inside ? 2.0 * delta * root - inside : s;
  weight *= s > inside ? delta / root : one;
}

}  // namespace ipl_slam::pose_kernel
