#pragma once

// Run-time choice of instruction set. The project is compiled for a baseline every processor has; a few hot
// functions carry a second body, marked IPL_SLAM_TARGET_AVX2, that is used where the processor can run it.
// Both bodies do the same integer arithmetic, so results never depend on the machine.

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#define IPL_SLAM_HAS_AVX2_CODE 1
#define IPL_SLAM_TARGET_AVX2 __attribute__((target("avx2")))
#else
#define IPL_SLAM_HAS_AVX2_CODE 0
#endif

namespace ipl_slam {

/// Which body of a function runs. Passed explicitly so that tests can compare the two.
enum class Simd { portable, avx2 };

/// The best body this processor can run.
[[nodiscard]] inline Simd best_simd() {
#if IPL_SLAM_HAS_AVX2_CODE
  static const Simd best = __builtin_cpu_supports("avx2") ? Simd::avx2 : Simd::portable;
  return best;
#else
  return Simd::portable;
#endif
}

}  // namespace ipl_slam
