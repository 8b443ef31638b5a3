#pragma once
// Sixteen lanes of AVX-512 (F, BW, DQ, VL) for bounding volumes and triangles.
#include <immintrin.h>

#include <cstdint>

struct CollisionLanes {
  static constexpr int width = 16;
  using Float = __m512;
  using Mask = __mmask16;

  static Float load(const float* p) { return _mm512_loadu_ps(p); }
  static Float load(const std::uint16_t* p) {
    return _mm512_cvtph_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)));
  }
  static Float load(const std::int16_t* p) {
    return _mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p))));
  }
  static void store(float* p, Float v) { _mm512_storeu_ps(p, v); }
  static Float broadcast(float v) { return _mm512_set1_ps(v); }

  static Float add(Float a, Float b) { return _mm512_add_ps(a, b); }
  static Float subtract(Float a, Float b) { return _mm512_sub_ps(a, b); }
  static Float multiply(Float a, Float b) { return _mm512_mul_ps(a, b); }
  static Float divide(Float a, Float b) { return _mm512_div_ps(a, b); }
  static Float multiply_add(Float a, Float b, Float c) { return _mm512_fmadd_ps(a, b, c); }
  static Float multiply_subtract(Float a, Float b, Float c) { return _mm512_fmsub_ps(a, b, c); }
  static Float min(Float a, Float b) { return _mm512_min_ps(a, b); }
  static Float max(Float a, Float b) { return _mm512_max_ps(a, b); }
  static Float abs(Float a) { return _mm512_abs_ps(a); }

  /// The least of `value` and the lanes of `v` that are set in `lanes`.
  static float least(float value, Float v, unsigned lanes) {
    return _mm512_reduce_min_ps(_mm512_mask_mov_ps(_mm512_set1_ps(value), static_cast<__mmask16>(lanes), v));
  }

  static Mask greater(Float a, Float b) { return _mm512_cmp_ps_mask(a, b, _CMP_GT_OQ); }
  static Mask not_less(Float a, Float b) { return _mm512_cmp_ps_mask(a, b, _CMP_GE_OQ); }
  static Float select(Mask m, Float a, Float b) { return _mm512_mask_blend_ps(m, b, a); }
  static unsigned bits(Mask m) { return m; }
  static Mask both(Mask a, Mask b) { return static_cast<Mask>(a & b); }
  static Mask either(Mask a, Mask b) { return static_cast<Mask>(a | b); }
  static Mask first(int n) { return static_cast<Mask>(n >= 16 ? 0xffff : (1 << n) - 1); }

  /// table[index[lane]], a table of `size` (16 or 32) aligned floats.
  static Float lookup(const float* table, int size, const std::int32_t* index) {
    const __m512i at = _mm512_loadu_si512(index);
    if (size == 16) return _mm512_permutexvar_ps(at, _mm512_load_ps(table));
    return _mm512_permutex2var_ps(_mm512_load_ps(table), at, _mm512_load_ps(table + 16));
  }
  /// `size` (16 or 32) values, to be looked up by index.
  template <int size>
  struct Table {
    Float part[size / 16];
    explicit Table(const std::int16_t* values) {
      for (int i = 0; i < size / 16; ++i) part[i] = load(values + 16 * i);
    }
    Float lookup(const std::int32_t* index) const {
      const __m512i at = _mm512_loadu_si512(index);
      if constexpr (size == 16)
        return _mm512_permutexvar_ps(at, part[0]);
      else
        return _mm512_permutex2var_ps(part[0], at, part[1]);
    }
  };
  /// out[c] lane i = row[i][first + c]; rows of aligned floats, `first` a multiple of four.
  static void load_transposed(const float* const* row, int first, Float* out) {
    Float of[4];  // in four lanes each, four values of rows k, k + 4, k + 8 and k + 12
    for (int k = 0; k < 4; ++k) {
      of[k] = _mm512_castps128_ps512(_mm_load_ps(row[k] + first));
      of[k] = _mm512_mask_broadcast_f32x4(of[k], 0x00f0, _mm_load_ps(row[k + 4] + first));
      of[k] = _mm512_mask_broadcast_f32x4(of[k], 0x0f00, _mm_load_ps(row[k + 8] + first));
      of[k] = _mm512_mask_broadcast_f32x4(of[k], 0xf000, _mm_load_ps(row[k + 12] + first));
    }
    const __m512d low01 = _mm512_castps_pd(_mm512_unpacklo_ps(of[0], of[1]));
    const __m512d high01 = _mm512_castps_pd(_mm512_unpackhi_ps(of[0], of[1]));
    const __m512d low23 = _mm512_castps_pd(_mm512_unpacklo_ps(of[2], of[3]));
    const __m512d high23 = _mm512_castps_pd(_mm512_unpackhi_ps(of[2], of[3]));
    out[0] = _mm512_castpd_ps(_mm512_unpacklo_pd(low01, low23));
    out[1] = _mm512_castpd_ps(_mm512_unpackhi_pd(low01, low23));
    out[2] = _mm512_castpd_ps(_mm512_unpacklo_pd(high01, high23));
    out[3] = _mm512_castpd_ps(_mm512_unpackhi_pd(high01, high23));
  }
  /// The numbers of the set bits to `b`, and `a` as often to `a_out`; room for sixteen.
  static void store_set_bits(unsigned bits, std::int32_t a, std::int32_t* a_out, std::int32_t* b_out) {
    const __m512i number = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    _mm512_storeu_si512(a_out, _mm512_set1_epi32(a));
    _mm512_storeu_si512(b_out, _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), number));
  }
  static float half_value(std::uint16_t half) { return _cvtsh_ss(half); }

  using Four = __m128;
  static Four load_four(const float* p) { return _mm_loadu_ps(p); }
  static Four load_four(const std::uint16_t* p) {
    return _mm_cvtph_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)));
  }
  static Four multiply_add(float s, Four b, Four c) { return _mm_fmadd_ps(_mm_set1_ps(s), b, c); }
  static Four broadcast_four(float s) { return _mm_set1_ps(s); }
  /// Lanes 4 i to 4 i + 3 hold value i (SIMDop, Fig. 4); `block` is 0.
  static Float spread(Four v, int) {
    const __m512i at = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
    return _mm512_permutexvar_ps(at, _mm512_castps128_ps512(v));
  }
  /// Lanes 4 i to 4 i + 3 hold all four values.
  static Float repeat(Four v, int) { return _mm512_broadcast_f32x4(v); }
};
