#include "loop/key_bits.hpp"

#include <array>
#include <bit>
#include <stdexcept>

namespace ipl_slam {
namespace {

constexpr std::size_t kBits = 256;

// One bit of all descriptors, packed.
using Column = std::vector<std::uint64_t>;

std::vector<Column> columns_of(std::span<const Descriptor> descriptors) {
  std::vector<Column> columns(kBits, Column((descriptors.size() + 63) / 64));
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    for (std::size_t b = 0; b < kBits; ++b) {
      columns[b][i / 64] |= (descriptors[i][b / 64] >> (b % 64) & 1U) << (i % 64);
    }
  }
  return columns;
}

double count_of(const Column& a, const Column& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += std::popcount(a[i] & b[i]);
  return count;
}

// Squared correlation of two bits; 1 where one of them never changes, which tells nothing new.
double phi_squared(double n, double n_a, double n_b, double n_ab) {
  const double variances = n_a * (n - n_a) * n_b * (n - n_b);
  if (variances == 0.0) return 1.0;
  const double covariance = n * n_ab - n_a * n_b;
  return covariance * covariance / variances;
}

}  // namespace

std::vector<KeyBits> choose_key_bits(std::span<const Descriptor> descriptors, std::size_t tables,
                                     std::size_t length) {
  if (tables * length > kBits) throw std::invalid_argument("more key bits than a descriptor has");
  const std::vector<Column> columns = columns_of(descriptors);
  const auto n = static_cast<double>(descriptors.size());
  std::array<double, kBits> set{};
  for (std::size_t b = 0; b < kBits; ++b) set[b] = count_of(columns[b], columns[b]);

  // Per table and bit: how much of the bit is known beforehand.
  std::vector<std::array<double, kBits>> known(tables);
  for (std::size_t b = 0; b < kBits; ++b) {
    const double bias = n > 0.0 ? 1.0 - 2.0 * set[b] / n : 0.0;
    for (auto& table : known) table[b] = bias * bias;
  }
  std::vector<KeyBits> keys(tables);
  std::array<bool, kBits> used{};
  for (std::size_t i = 0; i < tables * length; ++i) {
    std::array<double, kBits>& mine = known[i % tables];
    std::size_t best = kBits;
    for (std::size_t b = 0; b < kBits; ++b) {
      if (!used[b] && (best == kBits || mine[b] < mine[best])) best = b;
    }
    used[best] = true;
    keys[i % tables].push_back(static_cast<std::uint8_t>(best));
    for (std::size_t b = 0; b < kBits; ++b) {
      if (!used[b]) mine[b] += phi_squared(n, set[b], set[best], count_of(columns[b], columns[best]));
    }
  }
  return keys;
}

}  // namespace ipl_slam
