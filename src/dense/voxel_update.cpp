#include "dense/voxel_update.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#if IPL_SLAM_HAS_AVX2_CODE
#include <immintrin.h>
#endif

namespace ipl_slam {
namespace {

constexpr int kSumLimit = std::numeric_limits<std::uint16_t>::max();
constexpr int kSide = VoxelBlock::kSide;
constexpr int kSteps = VoxelBlock::kDistanceSteps;

// The first of eight voxels along x: its homogeneous pixel and its index in the block.
struct RowStart {
  float u, v, z;
  std::uint32_t index;
};
constexpr std::size_t kRows = VoxelBlock::kVoxels / kSide;

// A block and what is the same for all its voxels.
struct Job {
  const VolumeView::Ray* rays;
  std::int32_t width;
  float last_u, last_v;  // pixels nearer than this round to one of the picture's
  float truncation, steps_per_metre;
  std::int32_t free_weight;
  float du, dv, dz;  // what the homogeneous pixel grows by along x
  // Rows that are not wholly behind what is seen. Worked out before the AVX2 body begins: the two kinds of
  // code do not mix well.
  std::size_t rows;
  std::array<RowStart, kRows> starts;
};

Job make_job(const BlockCoord& place, const VolumeView& view, float sight) {
  Job job;
  job.rays = view.rays();
  job.width = view.width();
  job.last_u = static_cast<float>(view.width()) - 0.5F;
  job.last_v = static_cast<float>(view.height()) - 0.5F;
  job.truncation = view.truncation();
  job.steps_per_metre = static_cast<float>(kSteps) / view.truncation();
  job.free_weight = view.free_weight(place);
  const Eigen::Vector3f first = view.first_voxel(place);
  const Eigen::Matrix3f& steps = view.voxel_steps();
  job.du = steps(0, 0), job.dv = steps(1, 0), job.dz = steps(2, 0);
  const float depth_of_row = static_cast<float>(kSide - 1) * job.dz;
  job.rows = 0;
  for (std::size_t row = 0; row < kRows; ++row) {
    const auto y = static_cast<float>(row % kSide), z = static_cast<float>(row / kSide);
    const Eigen::Vector3f start = first + (y * steps.col(1) + z * steps.col(2));
    job.starts[job.rows] = {start.x(), start.y(), start.z(), static_cast<std::uint32_t>(row * kSide)};
    if (std::min(start.z(), start.z() + depth_of_row) < sight) ++job.rows;
  }
  return job;
}

template <Sum kSum>
void update_row_portable(VoxelBlock& block, const RowStart& start, const Job& job) {
  for (int x = 0; x < kSide; ++x) {
    const auto fx = static_cast<float>(x);
    const float z = start.z + fx * job.dz;
    if (!(z > 0.0F)) continue;
    const float inverse = 1.0F / z;
    const float u = (start.u + fx * job.du) * inverse, v = (start.v + fx * job.dv) * inverse;
    if (!(u > -0.5F && u < job.last_u && v > -0.5F && v < job.last_v)) continue;
    const VolumeView::Ray& ray = job.rays[std::lrint(v) * job.width + std::lrint(u)];
    const float distance = ray.incidence * (ray.depth - z);
    const bool is_surface = ray.depth > 0.0F && std::abs(distance) <= job.truncation;
    const bool is_free = ray.through > z && !is_surface;
    const std::size_t i = start.index + static_cast<std::size_t>(x);
    if (is_surface) {
      const int old = block.weight[i], room = kSum == Sum::kAdd ? kSumLimit - old : old;
      const int weight = std::min(static_cast<int>(ray.weight), room);
      const int share = weight * static_cast<int>(std::lrint(distance * job.steps_per_metre));
      const int now = kSum == Sum::kAdd ? old + weight : old - weight;
      const int total = kSum == Sum::kAdd ? block.distance[i] + share : block.distance[i] - share;
      block.weight[i] = static_cast<std::uint16_t>(now);
      block.distance[i] = std::clamp(total, -kSteps * now, kSteps * now);
    }
    if (is_free) {
      const int old = block.free[i];
      const int now = kSum == Sum::kAdd ? old + job.free_weight : old - job.free_weight;
      block.free[i] = static_cast<std::uint16_t>(std::clamp(now, 0, kSumLimit));
    }
  }
}

template <Sum kSum>
void update_portable(VoxelBlock& block, const Job& job) {
  for (std::size_t i = 0; i < job.rows; ++i) update_row_portable<kSum>(block, job.starts[i], job);
}

#if IPL_SLAM_HAS_AVX2_CODE

// The rays at eight places, member by member. Eight loads and a transposition: gathers would be slower.
struct Rays8 {
  __m256 depth, incidence, through, weight;
};

IPL_SLAM_TARGET_AVX2 inline __m256 two_rays(const VolumeView::Ray* a, const VolumeView::Ray* b) {
  const __m256 low = _mm256_castps128_ps256(_mm_loadu_ps(&a->depth));
  return _mm256_insertf128_ps(low, _mm_loadu_ps(&b->depth), 1);
}

IPL_SLAM_TARGET_AVX2 inline Rays8 load_rays(const VolumeView::Ray* rays, __m256i places) {
  alignas(32) std::int32_t at[kSide];
  _mm256_store_si256(reinterpret_cast<__m256i*>(at), places);
  const __m256 r04 = two_rays(rays + at[0], rays + at[4]), r15 = two_rays(rays + at[1], rays + at[5]);
  const __m256 r26 = two_rays(rays + at[2], rays + at[6]), r37 = two_rays(rays + at[3], rays + at[7]);
  const __m256 a = _mm256_unpacklo_ps(r04, r15), b = _mm256_unpacklo_ps(r26, r37);
  const __m256 c = _mm256_unpackhi_ps(r04, r15), d = _mm256_unpackhi_ps(r26, r37);
  return {_mm256_shuffle_ps(a, b, 0x44), _mm256_shuffle_ps(a, b, 0xEE), _mm256_shuffle_ps(c, d, 0x44),
          _mm256_shuffle_ps(c, d, 0xEE)};
}

// Eight whole numbers from 0 to 65535, in 16 bits each.
IPL_SLAM_TARGET_AVX2 inline __m128i narrow(__m256i values) {
  return _mm_packus_epi32(_mm256_castsi256_si128(values), _mm256_extracti128_si256(values, 1));
}

template <Sum kSum>
IPL_SLAM_TARGET_AVX2 inline void add_surface(VoxelBlock& block, std::size_t index, __m256i weight,
                                             __m256i distance) {
  auto* weights = reinterpret_cast<__m128i*>(block.weight.data() + index);
  auto* distances = reinterpret_cast<__m256i*>(block.distance.data() + index);
  const __m256i old = _mm256_cvtepu16_epi32(_mm_load_si128(weights));
  const __m256i room = kSum == Sum::kAdd ? _mm256_sub_epi32(_mm256_set1_epi32(kSumLimit), old) : old;
  weight = _mm256_min_epi32(weight, room);
  const __m256i share = _mm256_mullo_epi32(weight, distance);
  const __m256i before = _mm256_load_si256(distances);
  const __m256i now = kSum == Sum::kAdd ? _mm256_add_epi32(old, weight) : _mm256_sub_epi32(old, weight);
  __m256i total = kSum == Sum::kAdd ? _mm256_add_epi32(before, share) : _mm256_sub_epi32(before, share);
  const __m256i limit = _mm256_mullo_epi32(now, _mm256_set1_epi32(kSteps));
  total = _mm256_max_epi32(total, _mm256_sub_epi32(_mm256_setzero_si256(), limit));
  _mm256_store_si256(distances, _mm256_min_epi32(total, limit));
  _mm_store_si128(weights, narrow(now));
}

template <Sum kSum>
IPL_SLAM_TARGET_AVX2 inline void add_free(VoxelBlock& block, std::size_t index, __m256i weight) {
  auto* sums = reinterpret_cast<__m128i*>(block.free.data() + index);
  const __m128i old = _mm_load_si128(sums), share = narrow(weight);
  _mm_store_si128(sums, kSum == Sum::kAdd ? _mm_adds_epu16(old, share) : _mm_subs_epu16(old, share));
}

IPL_SLAM_TARGET_AVX2 inline __m256 along(float first, float step) {
  const __m256 x = _mm256_setr_ps(0.0F, 1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F, 7.0F);
  return _mm256_add_ps(_mm256_set1_ps(first), _mm256_mul_ps(x, _mm256_set1_ps(step)));
}

IPL_SLAM_TARGET_AVX2 inline __m256 between(__m256 value, float low, float high) {
  return _mm256_and_ps(_mm256_cmp_ps(value, _mm256_set1_ps(low), _CMP_GT_OQ),
                       _mm256_cmp_ps(value, _mm256_set1_ps(high), _CMP_LT_OQ));
}

template <Sum kSum>
IPL_SLAM_TARGET_AVX2 inline void update_row_avx2(VoxelBlock& block, const RowStart& start, const Job& job) {
  const __m256 zero = _mm256_setzero_ps();
  const __m256 z = along(start.z, job.dz);
  const __m256 inverse = _mm256_div_ps(_mm256_set1_ps(1.0F), z);
  const __m256 u = _mm256_mul_ps(along(start.u, job.du), inverse);
  const __m256 v = _mm256_mul_ps(along(start.v, job.dv), inverse);
  const __m256 in_view =
      _mm256_and_ps(_mm256_cmp_ps(z, zero, _CMP_GT_OQ),
                    _mm256_and_ps(between(u, -0.5F, job.last_u), between(v, -0.5F, job.last_v)));
  if (_mm256_movemask_ps(in_view) == 0) return;
  const __m256i line = _mm256_mullo_epi32(_mm256_cvtps_epi32(v), _mm256_set1_epi32(job.width));
  const __m256i place = _mm256_add_epi32(line, _mm256_cvtps_epi32(u));
  const Rays8 ray = load_rays(job.rays, _mm256_and_si256(place, _mm256_castps_si256(in_view)));
  const __m256 distance = _mm256_mul_ps(ray.incidence, _mm256_sub_ps(ray.depth, z));
  const __m256 size = _mm256_andnot_ps(_mm256_set1_ps(-0.0F), distance);
  const __m256 near = _mm256_and_ps(_mm256_cmp_ps(ray.depth, zero, _CMP_GT_OQ),
                                    _mm256_cmp_ps(size, _mm256_set1_ps(job.truncation), _CMP_LE_OQ));
  const __m256 is_surface = _mm256_and_ps(in_view, near);
  const __m256 is_free =
      _mm256_andnot_ps(near, _mm256_and_ps(in_view, _mm256_cmp_ps(ray.through, z, _CMP_GT_OQ)));
  if (_mm256_movemask_ps(is_surface) != 0) {
    const __m256i steps = _mm256_cvtps_epi32(_mm256_mul_ps(distance, _mm256_set1_ps(job.steps_per_metre)));
    const __m256i weight = _mm256_cvtps_epi32(ray.weight), mask = _mm256_castps_si256(is_surface);
    add_surface<kSum>(block, start.index, _mm256_and_si256(weight, mask), _mm256_and_si256(steps, mask));
  }
  if (_mm256_movemask_ps(is_free) != 0) {
    const __m256i weight = _mm256_set1_epi32(job.free_weight);
    add_free<kSum>(block, start.index, _mm256_and_si256(weight, _mm256_castps_si256(is_free)));
  }
}

template <Sum kSum>
IPL_SLAM_TARGET_AVX2 void update_avx2(VoxelBlock& block, const Job& job) {
  for (std::size_t i = 0; i < job.rows; ++i) update_row_avx2<kSum>(block, job.starts[i], job);
}

#endif

}  // namespace

void update_block(VoxelBlock& block, const BlockCoord& place, const VolumeView& view, float sight, Sum sum,
                  Simd simd) {
  const Job job = make_job(place, view, sight);
#if IPL_SLAM_HAS_AVX2_CODE
  if (simd == Simd::avx2) {
    return sum == Sum::kAdd ? update_avx2<Sum::kAdd>(block, job) : update_avx2<Sum::kTakeOut>(block, job);
  }
#endif
  static_cast<void>(simd);
  return sum == Sum::kAdd ? update_portable<Sum::kAdd>(block, job)
                          : update_portable<Sum::kTakeOut>(block, job);
}

}  // namespace ipl_slam
