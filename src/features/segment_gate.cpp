#include "features/segment_gate.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#if IPL_SLAM_HAS_AVX2_CODE
#include <immintrin.h>
#endif

namespace ipl_slam {
namespace {

constexpr std::size_t kLanes = 8;
constexpr float kMinLength = 1e-3F;  // shorter ones have no direction, pixels

}  // namespace

SegmentTable::SegmentTable(std::span<const LineSegment> segments) : count_(segments.size()) {
  const std::size_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
  for (auto* column : {&start_u_, &start_v_, &end_u_, &end_v_, &direction_u_, &direction_v_, &length_}) {
    column->resize(padded);
  }
  for (std::size_t i = 0; i < count_; ++i) {
    const LineSegment& s = segments[i];
    start_u_[i] = s.start.x(), start_v_[i] = s.start.y();
    end_u_[i] = s.end.x(), end_v_[i] = s.end.y();
    length_[i] = s.length();
    if (!(length_[i] > kMinLength)) continue;
    direction_u_[i] = (s.end.x() - s.start.x()) / length_[i];
    direction_v_[i] = (s.end.y() - s.start.y()) / length_[i];
  }
}

namespace {

struct Columns {
  const float *start_u, *start_v, *end_u, *end_v, *direction_u, *direction_v, *length;
};

/// The expected line.
struct Expected {
  float u, v, direction_u, direction_v, length;
};

// Both bodies do the same operations in the same order.
void find_portable(const Columns& c, const Expected& e, const SegmentGate& gate, std::size_t count,
                   std::vector<int>& found) {
  for (std::size_t i = 0; i < count; ++i) {
    const float cosine = e.direction_u * c.direction_u[i] + e.direction_v * c.direction_v[i];
    const float su = c.start_u[i] - e.u, sv = c.start_v[i] - e.v;
    const float eu = c.end_u[i] - e.u, ev = c.end_v[i] - e.v;
    const float start_across = std::fabs(e.direction_u * sv - e.direction_v * su);
    const float end_across = std::fabs(e.direction_u * ev - e.direction_v * eu);
    const float start_along = e.direction_u * su + e.direction_v * sv;
    const float end_along = e.direction_u * eu + e.direction_v * ev;
    const float overlap = std::min(end_along, e.length) - std::max(start_along, 0.0F) + gate.along;
    const float shorter = std::min(c.length[i], e.length), longer = std::max(c.length[i], e.length);
    if ((cosine >= gate.min_cosine) & (start_across <= gate.radius) & (end_across <= gate.radius) &
        (overlap >= gate.min_overlap * shorter) & (longer <= gate.max_length_ratio * shorter)) {
      found.push_back(static_cast<int>(i));
    }
  }
}

#if IPL_SLAM_HAS_AVX2_CODE

IPL_SLAM_TARGET_AVX2 inline __m256 absolute(__m256 x) {
  return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), x);
}
IPL_SLAM_TARGET_AVX2 inline __m256 dot(__m256 au, __m256 av, __m256 bu, __m256 bv) {
  return _mm256_add_ps(_mm256_mul_ps(au, bu), _mm256_mul_ps(av, bv));
}
IPL_SLAM_TARGET_AVX2 inline __m256 cross(__m256 au, __m256 av, __m256 bu, __m256 bv) {
  return _mm256_sub_ps(_mm256_mul_ps(au, bv), _mm256_mul_ps(av, bu));
}

IPL_SLAM_TARGET_AVX2 void find_avx2(const Columns& c, const Expected& e, const SegmentGate& gate,
                                    std::size_t count, std::vector<int>& found) {
  const __m256 u = _mm256_set1_ps(e.u), v = _mm256_set1_ps(e.v), length = _mm256_set1_ps(e.length);
  const __m256 du = _mm256_set1_ps(e.direction_u), dv = _mm256_set1_ps(e.direction_v);
  const __m256 radius = _mm256_set1_ps(gate.radius), min_cosine = _mm256_set1_ps(gate.min_cosine);
  const __m256 min_overlap = _mm256_set1_ps(gate.min_overlap), along = _mm256_set1_ps(gate.along);
  const __m256 ratio = _mm256_set1_ps(gate.max_length_ratio);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const __m256 cosine = dot(du, dv, _mm256_loadu_ps(c.direction_u + i), _mm256_loadu_ps(c.direction_v + i));
    const __m256 su = _mm256_sub_ps(_mm256_loadu_ps(c.start_u + i), u);
    const __m256 sv = _mm256_sub_ps(_mm256_loadu_ps(c.start_v + i), v);
    const __m256 eu = _mm256_sub_ps(_mm256_loadu_ps(c.end_u + i), u);
    const __m256 ev = _mm256_sub_ps(_mm256_loadu_ps(c.end_v + i), v);
    const __m256 start_across = absolute(cross(du, dv, su, sv)), end_across = absolute(cross(du, dv, eu, ev));
    const __m256 first = _mm256_max_ps(dot(du, dv, su, sv), _mm256_setzero_ps());
    const __m256 last = _mm256_min_ps(dot(du, dv, eu, ev), length);
    const __m256 overlap = _mm256_add_ps(_mm256_sub_ps(last, first), along);
    const __m256 own_length = _mm256_loadu_ps(c.length + i);
    const __m256 shorter = _mm256_min_ps(own_length, length), longer = _mm256_max_ps(own_length, length);
    __m256 pass = _mm256_cmp_ps(cosine, min_cosine, _CMP_GE_OQ);
    pass = _mm256_and_ps(pass, _mm256_cmp_ps(start_across, radius, _CMP_LE_OQ));
    pass = _mm256_and_ps(pass, _mm256_cmp_ps(end_across, radius, _CMP_LE_OQ));
    pass = _mm256_and_ps(pass, _mm256_cmp_ps(overlap, _mm256_mul_ps(min_overlap, shorter), _CMP_GE_OQ));
    pass = _mm256_and_ps(pass, _mm256_cmp_ps(longer, _mm256_mul_ps(ratio, shorter), _CMP_LE_OQ));
    for (auto bits = static_cast<unsigned>(_mm256_movemask_ps(pass)); bits != 0; bits &= bits - 1) {
      found.push_back(static_cast<int>(i) + std::countr_zero(bits));
    }
  }
}

#endif

}  // namespace

void SegmentTable::find(const Eigen::Vector2f& start, const Eigen::Vector2f& end, const SegmentGate& gate,
                        Simd simd, std::vector<int>& found) const {
  const float length = (end - start).norm();
  if (!(length > kMinLength)) return;
  const Columns columns{start_u_.data(),     start_v_.data(),     end_u_.data(), end_v_.data(),
                        direction_u_.data(), direction_v_.data(), length_.data()};
  const Expected expected{start.x(), start.y(), (end.x() - start.x()) / length,
                          (end.y() - start.y()) / length, length};
#if IPL_SLAM_HAS_AVX2_CODE
  if (simd == Simd::avx2) return find_avx2(columns, expected, gate, count_, found);
#endif
  static_cast<void>(simd);
  find_portable(columns, expected, gate, count_, found);
}

}  // namespace ipl_slam
