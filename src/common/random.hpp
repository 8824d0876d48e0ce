#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

namespace ipl_slam {

/// Scrambles 64 bits so that neighbouring inputs give unrelated outputs (the finaliser of splitmix64: Steele,
/// Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Hash of two numbers; nest it for more. For values that must not depend on the order in which they are
/// drawn, e.g. the noise of a pixel: hash64(hash64(seed, frame), pixel).
[[nodiscard]] constexpr std::uint64_t hash64(std::uint64_t a, std::uint64_t b) {
  return mix64(a + 0x9e3779b97f4a7c15ULL * (b + 1));
}

/// The numbers a stage draws from, under the seed of the run: with another seed all of them draw others. Seed
/// 0 leaves `own`, what the stage takes by itself, as it is.
[[nodiscard]] constexpr std::uint64_t seeded(std::uint64_t own, std::uint64_t seed) {
  return own ^ mix64(seed);
}

/// Turns 64 random bits into a number in [0, 1).
[[nodiscard]] constexpr double unit_from_bits(std::uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1.0p-53;
}

/// Turns 64 random bits into an approximately normal number (mean 0, deviation 1) without a logarithm: the
/// scaled sum of four 16-bit uniforms, so never beyond 3.47. For pixel noise, where millions are needed.
[[nodiscard]] constexpr float fast_normal_from_bits(std::uint64_t bits) {
  const auto sum = static_cast<std::int64_t>((bits & 0xffff) + ((bits >> 16) & 0xffff) +
                                             ((bits >> 32) & 0xffff) + (bits >> 48));
  constexpr float kScale = 1.7320508F / 65536.0F;  // the sum of four has a deviation of 65536 / sqrt(3)
  return static_cast<float>(sum - 131070) * kScale;
}

/// The project's one random generator: seeded, small, and the same on every machine, unlike the distributions
/// of <random>. The generator is xoshiro256** (Blackman and Vigna, "Scrambled linear pseudorandom number
/// generators", ACM TOMS 2021), seeded through splitmix64. Not for secrets.
class Random {
 public:
  explicit Random(std::uint64_t seed) {
    for (std::uint64_t& word : state_) {
      seed += 0x9e3779b97f4a7c15ULL;
      word = mix64(seed);
    }
  }

  /// 64 random bits.
  std::uint64_t bits() {
    const std::uint64_t result = rotate(state_[1] * 5, 7) * 9;
    const std::uint64_t t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = rotate(state_[3], 45);
    return result;
  }

  /// Uniform in [0, 1).
  double uniform() { return unit_from_bits(bits()); }
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Uniform integer below count, every value equally likely; count must be at least 1. For indices.
  std::uint64_t index(std::uint64_t count) {
    // Draws from the incomplete last multiple of count are thrown away: they would favour small values.
    const std::uint64_t reject_below = (0 - count) % count;
    std::uint64_t value = bits();
    while (value < reject_below) value = bits();
    return value % count;
  }
  /// Uniform integer in [low, high], both included.
  int uniform_int(int low, int high) {
    const auto span = static_cast<std::uint64_t>(static_cast<std::int64_t>(high) - low) + 1;
    return static_cast<int>(low + static_cast<std::int64_t>(index(span)));
  }
  /// True with the given probability.
  bool chance(double probability) { return uniform() < probability; }

  /// Normal with mean 0 and deviation 1 (Box-Muller; nothing is kept between calls).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  double normal(double mean, double deviation) { return mean + deviation * normal(); }

  /// Puts the elements of a random-access container in random order (Fisher-Yates).
  template <class Container>
  void shuffle(Container& items) {
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[index(i)]);
  }

 private:
  static constexpr std::uint64_t rotate(std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

  std::uint64_t state_[4];
};

}  // namespace ipl_slam
