#pragma once
// Sixteen lanes of AVX-512 (F, BW, DQ, VL).
#include <immintrin.h>

#include <cstdint>

struct Lanes {
  static constexpr int width = 16;
  using Float = __m512;
  using Uint = __m512i;
  using Mask = __mmask16;

  static Float load(const float* p) { return _mm512_loadu_ps(p); }
  static Uint load(const std::uint32_t* p) { return _mm512_loadu_si512(p); }
  static void store(float* p, Float v) { _mm512_storeu_ps(p, v); }
  static void store(std::uint32_t* p, Uint v) { _mm512_storeu_si512(p, v); }
  static Float broadcast(float v) { return _mm512_set1_ps(v); }
  static Uint broadcast(std::uint32_t v) { return _mm512_set1_epi32(static_cast<int>(v)); }

  static Float add(Float a, Float b) { return _mm512_add_ps(a, b); }
  static Float multiply_add(Float a, Float b, Float c) { return _mm512_fmadd_ps(a, b, c); }
  static Float min(Float a, Float b) { return _mm512_min_ps(a, b); }
  static Float max(Float a, Float b) { return _mm512_max_ps(a, b); }
  static Float truncate(Float a) { return _mm512_roundscale_ps(a, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
  static float reduce_min(Float a) { return _mm512_reduce_min_ps(a); }
  static float reduce_max(Float a) { return _mm512_reduce_max_ps(a); }
  static Mask less_equal(Float a, Float b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
  static Mask equal(Float a, Float b) { return _mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ); }

  static Mask both(Mask a, Mask b) { return _kand_mask16(a, b); }
  static Mask either(Mask a, Mask b) { return _kor_mask16(a, b); }
  static Mask invert(Mask a) { return _knot_mask16(a); }
  static bool any(Mask a) { return a != 0; }
  static unsigned bits(Mask a) { return a; }
  static Mask from_bits(unsigned bits) { return static_cast<Mask>(bits); }
  static Float select(Mask m, Float a, Float b) { return _mm512_mask_blend_ps(m, b, a); }
  static Uint select(Mask m, Uint a, Uint b) { return _mm512_mask_blend_epi32(m, b, a); }

  static Mask nonzero(Uint a) { return _mm512_test_epi32_mask(a, a); }
  static Uint subtract(Uint a, Uint b) { return _mm512_sub_epi32(a, b); }
  static Uint decrement_where(Uint a, Mask m) { return _mm512_mask_sub_epi32(a, m, a, _mm512_set1_epi32(1)); }
  static Float increment_where(Float a, Mask m) { return _mm512_mask_add_ps(a, m, a, _mm512_set1_ps(1.0f)); }
  static Uint combine(Uint a, Uint b, Uint c) { return _mm512_ternarylogic_epi32(a, b, c, 0xfe); }
  static Uint dilated_step(Uint p, Uint decrement, Uint mask, Mask m) {
    return _mm512_mask_and_epi32(p, m, _mm512_sub_epi32(p, decrement), mask);
  }

  // A scatter of bytes does not exist; sixteen plain stores beat a scatter of dwords.
  static void mark(std::uint8_t* bytes, Uint index) {
    alignas(64) std::uint32_t at[width];
    _mm512_store_si512(at, index);
    // Reloading each index costs a load port; extracting it from the register would cost two vector ports.
    asm("" : "+m"(at));
    for (int lane = 0; lane < width; ++lane) bytes[at[lane]] = 1;
  }
};
