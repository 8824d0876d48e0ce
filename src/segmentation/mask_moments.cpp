#include "segmentation/mask_moments.hpp"

#include <bit>
#include <cmath>

namespace ipl_slam {
namespace {

constexpr int kMaxSide = 8192;  // x^3, summed over a full mask, then stays below 2^63

// Sums of 1, x, x^2 and x^3 over the pixels of a row.
struct PowerSums {
  std::int64_t s0 = 0, s1 = 0, s2 = 0, s3 = 0;
};

// A row is a set of runs, and the sum of x^k over a run from a to b - 1 is F_k(b) - F_k(a) with F_k(n) the
// sum over 0 .. n - 1, which has a closed form. So each end of a run, found as a bit that differs from the
// one to its left, adds F_k with the sign of its kind.
PowerSums row_sums(const std::uint64_t* words, int count, int width) {
  PowerSums sums;
  const auto add = [&sums](std::int64_t n, std::int64_t sign) {
    const std::int64_t f1 = n * (n - 1) / 2;
    sums.s0 += sign * n;
    sums.s1 += sign * f1;
    sums.s2 += sign * (f1 * (2 * n - 1) / 3);
    sums.s3 += sign * f1 * f1;
  };
  std::uint64_t last = 0;  // the bit left of the word
  for (int i = 0; i < count; ++i) {
    std::uint64_t ends = words[i] ^ (words[i] << 1 | last);
    last = words[i] >> 63;
    for (; ends != 0; ends &= ends - 1) {
      const int bit = std::countr_zero(ends);
      add(64 * i + bit, words[i] >> bit & 1U ? -1 : 1);
    }
  }
  if (last != 0) add(width, 1);  // a run that ends with the last word
  return sums;
}

Moments<std::uint64_t> modulo(const Moments<std::int64_t>& m) {
  const auto u = [](std::int64_t value) { return static_cast<std::uint64_t>(value); };
  return {u(m.m00), u(m.m10), u(m.m01), u(m.m20), u(m.m11), u(m.m02), u(m.m30), u(m.m21), u(m.m12), u(m.m03)};
}

// Moments about (x, y) instead of (0, 0). In integers, so that nothing is lost where large moments cancel,
// and modulo 2^64, since summands may be larger: the results, moments about the shape's middle, are not.
Moments<double> shifted(const Moments<std::int64_t>& signed_moments, std::int64_t middle_x,
                        std::int64_t middle_y) {
  const Moments<std::uint64_t> m = modulo(signed_moments);
  const auto x = static_cast<std::uint64_t>(middle_x), y = static_cast<std::uint64_t>(middle_y);
  const auto number = [](std::uint64_t value) {
    return static_cast<double>(static_cast<std::int64_t>(value));
  };
  Moments<double> s;
  s.m00 = number(m.m00);
  s.m10 = number(m.m10 - x * m.m00);
  s.m01 = number(m.m01 - y * m.m00);
  s.m20 = number(m.m20 - 2 * x * m.m10 + x * x * m.m00);
  s.m11 = number(m.m11 - x * m.m01 - y * m.m10 + x * y * m.m00);
  s.m02 = number(m.m02 - 2 * y * m.m01 + y * y * m.m00);
  s.m30 = number(m.m30 - 3 * x * m.m20 + 3 * x * x * m.m10 - x * x * x * m.m00);
  s.m21 = number(m.m21 - 2 * x * m.m11 + x * x * m.m01 - y * (m.m20 - 2 * x * m.m10 + x * x * m.m00));
  s.m12 = number(m.m12 - 2 * y * m.m11 + y * y * m.m10 - x * (m.m02 - 2 * y * m.m01 + y * y * m.m00));
  s.m03 = number(m.m03 - 3 * y * m.m02 + 3 * y * y * m.m01 - y * y * y * m.m00);
  return s;
}

}  // namespace

Moments<std::int64_t> mask_moments(const BitMask& mask) {
  CV_Assert(mask.size().width <= kMaxSide && mask.size().height <= kMaxSide);
  Moments<std::int64_t> m;
  for (std::int64_t y = 0; y < mask.size().height; ++y) {
    const PowerSums row = row_sums(mask.row(static_cast<int>(y)), mask.words_per_row(), mask.size().width);
    m.m00 += row.s0;
    m.m10 += row.s1;
    m.m20 += row.s2;
    m.m30 += row.s3;
    m.m01 += y * row.s0;
    m.m11 += y * row.s1;
    m.m21 += y * row.s2;
    m.m02 += y * y * row.s0;
    m.m12 += y * y * row.s1;
    m.m03 += y * y * y * row.s0;
  }
  return m;
}

HuInvariants hu_invariants(const Moments<std::int64_t>& m) {
  if (m.m00 == 0) return {};
  return hu_invariants(shifted(m, m.m10 / m.m00, m.m01 / m.m00));
}

HuInvariants hu_invariants(const Moments<double>& m) {
  if (m.m00 <= 0.0) return {};
  const double x = m.m10 / m.m00, y = m.m01 / m.m00;
  // Central moments, made independent of size.
  const double second = 1.0 / (m.m00 * m.m00), third = second / std::sqrt(m.m00);
  const double n20 = second * (m.m20 - x * m.m10);
  const double n11 = second * (m.m11 - x * m.m01);
  const double n02 = second * (m.m02 - y * m.m01);
  const double n30 = third * (m.m30 - 3.0 * x * m.m20 + 2.0 * x * x * m.m10);
  const double n21 = third * (m.m21 - 2.0 * x * m.m11 - y * m.m20 + 2.0 * x * x * m.m01);
  const double n12 = third * (m.m12 - 2.0 * y * m.m11 - x * m.m02 + 2.0 * y * y * m.m10);
  const double n03 = third * (m.m03 - 3.0 * y * m.m02 + 2.0 * y * y * m.m01);

  const double a = n30 + n12, b = n21 + n03;              // the sums and
  const double c = n30 - 3.0 * n12, d = 3.0 * n21 - n03;  // differences of which Hu's formulas consist
  const double e = n20 - n02;
  const double p = a * a - 3.0 * b * b, q = 3.0 * a * a - b * b;
  return {n20 + n02,
          e * e + 4.0 * n11 * n11,
          c * c + d * d,
          a * a + b * b,
          c * a * p + d * b * q,
          e * (a * a - b * b) + 4.0 * n11 * a * b,
          d * a * p - c * b * q};
}

}  // namespace ipl_slam
