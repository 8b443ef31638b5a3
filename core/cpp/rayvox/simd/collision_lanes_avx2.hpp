#pragma once
// Eight lanes of AVX2 with FMA and F16C, for bounding volumes and triangles.
#include <immintrin.h>

#include <cstdint>

struct CollisionLanes {
  static constexpr int width = 8;
  using Float = __m256;
  using Mask = __m256;

  static Float load(const float* p) { return _mm256_loadu_ps(p); }
  static Float load(const std::uint16_t* p) {
    return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
  }
  static void store(float* p, Float v) { _mm256_storeu_ps(p, v); }
  static Float broadcast(float v) { return _mm256_set1_ps(v); }

  static Float add(Float a, Float b) { return _mm256_add_ps(a, b); }
  static Float subtract(Float a, Float b) { return _mm256_sub_ps(a, b); }
  static Float multiply(Float a, Float b) { return _mm256_mul_ps(a, b); }
  static Float divide(Float a, Float b) { return _mm256_div_ps(a, b); }
  static Float multiply_add(Float a, Float b, Float c) { return _mm256_fmadd_ps(a, b, c); }
  static Float multiply_subtract(Float a, Float b, Float c) { return _mm256_fmsub_ps(a, b, c); }
  static Float min(Float a, Float b) { return _mm256_min_ps(a, b); }
  static Float max(Float a, Float b) { return _mm256_max_ps(a, b); }
  static Float abs(Float a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }

  /// The least of `value` and the lanes of `v` that are set in `lanes`.
  static float least(float value, Float v, unsigned lanes) {
    float values[8];
    _mm256_storeu_ps(values, v);
    for (; lanes; lanes &= lanes - 1) {
      const float one = values[__builtin_ctz(lanes)];
      if (one < value) value = one;
    }
    return value;
  }

  static Mask greater(Float a, Float b) { return _mm256_cmp_ps(a, b, _CMP_GT_OQ); }
  static Mask not_less(Float a, Float b) { return _mm256_cmp_ps(a, b, _CMP_GE_OQ); }
  static Float select(Mask m, Float a, Float b) { return _mm256_blendv_ps(b, a, m); }
  static unsigned bits(Mask m) { return static_cast<unsigned>(_mm256_movemask_ps(m)); }
  static Mask both(Mask a, Mask b) { return _mm256_and_ps(a, b); }
  static Mask either(Mask a, Mask b) { return _mm256_or_ps(a, b); }
  static Mask first(int n) {
    return _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(n), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)));
  }

  /// table[index[lane]].
  static Float lookup(const float* table, int, const std::int32_t* index) {
    return _mm256_i32gather_ps(table, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(index)), 4);
  }
  static float half_value(std::uint16_t half) { return _cvtsh_ss(half); }

  using Four = __m128;
  static Four load_four(const float* p) { return _mm_loadu_ps(p); }
  static Four load_four(const std::uint16_t* p) {
    return _mm_cvtph_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)));
  }
  static Four multiply_add(float s, Four b, Four c) { return _mm_fmadd_ps(_mm_set1_ps(s), b, c); }
  static Four broadcast_four(float s) { return _mm_set1_ps(s); }
  /// Lanes 4 i to 4 i + 3 hold value 2 block + i (SIMDop, Fig. 4).
  static Float spread(Four v, int block) {
    const __m256i at = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
    return _mm256_permutevar8x32_ps(_mm256_castps128_ps256(v), _mm256_add_epi32(at, _mm256_set1_epi32(2 * block)));
  }
  /// Lanes 4 i to 4 i + 3 hold all four values.
  static Float repeat(Four v, int) { return _mm256_set_m128(v, v); }
};
