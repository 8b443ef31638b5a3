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
  static Float load(const std::int16_t* p) {
    return _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p))));
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
  /// `size` values, to be looked up by index.
  template <int size>
  struct Table {
    alignas(32) float value[size];
    explicit Table(const std::int16_t* values) {
      for (int i = 0; i < size; i += width) store(value + i, load(values + i));
    }
    Float lookup(const std::int32_t* index) const { return CollisionLanes::lookup(value, size, index); }
  };
  /// out[c] lane i = row[i][first + c]; rows of aligned floats, `first` a multiple of four.
  static void load_transposed(const float* const* row, int first, Float* out) {
    Float of[4];  // in four lanes each, four values of rows k and k + 4
    for (int k = 0; k < 4; ++k) of[k] = _mm256_set_m128(_mm_load_ps(row[k + 4] + first), _mm_load_ps(row[k] + first));
    const __m256d low01 = _mm256_castps_pd(_mm256_unpacklo_ps(of[0], of[1]));
    const __m256d high01 = _mm256_castps_pd(_mm256_unpackhi_ps(of[0], of[1]));
    const __m256d low23 = _mm256_castps_pd(_mm256_unpacklo_ps(of[2], of[3]));
    const __m256d high23 = _mm256_castps_pd(_mm256_unpackhi_ps(of[2], of[3]));
    out[0] = _mm256_castpd_ps(_mm256_unpacklo_pd(low01, low23));
    out[1] = _mm256_castpd_ps(_mm256_unpackhi_pd(low01, low23));
    out[2] = _mm256_castpd_ps(_mm256_unpacklo_pd(high01, high23));
    out[3] = _mm256_castpd_ps(_mm256_unpackhi_pd(high01, high23));
  }
  /// The numbers of the set bits to `b_out`, and `a` as often to `a_out`; room for sixteen.
  static void store_set_bits(unsigned bits, std::int32_t a, std::int32_t* a_out, std::int32_t* b_out) {
    for (; bits; bits &= bits - 1) {
      *a_out++ = a;
      *b_out++ = __builtin_ctz(bits);
    }
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
