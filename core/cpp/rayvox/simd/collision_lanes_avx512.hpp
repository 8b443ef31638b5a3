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
