#pragma once
// Sixteen lanes of AVX-512 (F, BW, DQ, VL).
#include <immintrin.h>

#include <cstdint>

struct Lanes {
  static constexpr int width = 16;
  using Float = __m512;
  using Uint = __m512i;
  using Mask = __mmask16;
  static constexpr unsigned all_bits = 0xffff;

  static Float load(const float* p) { return _mm512_loadu_ps(p); }
  static Uint load(const std::uint32_t* p) { return _mm512_loadu_si512(p); }
  /// The first three of every four floats, by column: of half as many rows as there are lanes from `first` on, then as
  /// many from `second` on.
  static constexpr int rows_at_once = 2;
  static void load_columns(const float* first, const float* second, Float& a, Float& b, Float& c) {
    const Float r0 = load(first), r1 = load(first + 16), r2 = load(second), r3 = load(second + 16);
    const Uint pick = _mm512_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28, 0, 4, 8, 12, 16, 20, 24, 28);
    const Uint next = _mm512_add_epi32(pick, _mm512_set1_epi32(1)), last = _mm512_add_epi32(pick, _mm512_set1_epi32(2));
    a = _mm512_shuffle_f32x4(_mm512_permutex2var_ps(r0, pick, r1), _mm512_permutex2var_ps(r2, pick, r3), 0x44);
    b = _mm512_shuffle_f32x4(_mm512_permutex2var_ps(r0, next, r1), _mm512_permutex2var_ps(r2, next, r3), 0x44);
    c = _mm512_shuffle_f32x4(_mm512_permutex2var_ps(r0, last, r1), _mm512_permutex2var_ps(r2, last, r3), 0x44);
  }
  static void store(float* p, Float v) { _mm512_storeu_ps(p, v); }
  static void store(std::uint32_t* p, Uint v) { _mm512_storeu_si512(p, v); }
  static Float broadcast(float v) { return _mm512_set1_ps(v); }
  static Uint broadcast(std::uint32_t v) { return _mm512_set1_epi32(static_cast<int>(v)); }

  static Float add(Float a, Float b) { return _mm512_add_ps(a, b); }
  static Float subtract(Float a, Float b) { return _mm512_sub_ps(a, b); }
  static Float multiply(Float a, Float b) { return _mm512_mul_ps(a, b); }
  static Float divide(Float a, Float b) { return _mm512_div_ps(a, b); }
  static Float multiply_add(Float a, Float b, Float c) { return _mm512_fmadd_ps(a, b, c); }
  static Float min(Float a, Float b) { return _mm512_min_ps(a, b); }
  static Float max(Float a, Float b) { return _mm512_max_ps(a, b); }
  static Float absolute(Float a) { return _mm512_abs_ps(a); }
  static Float ceil(Float a) { return _mm512_roundscale_ps(a, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC); }
  static Float truncate(Float a) { return _mm512_roundscale_ps(a, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
  static float reduce_min(Float a) { return _mm512_reduce_min_ps(a); }
  static float reduce_max(Float a) { return _mm512_reduce_max_ps(a); }
  static Mask less_equal(Float a, Float b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
  static Mask less_than(Float a, Float b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
  static Mask equal(Float a, Float b) { return _mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ); }

  static Mask both(Mask a, Mask b) { return _kand_mask16(a, b); }
  static Mask either(Mask a, Mask b) { return _kor_mask16(a, b); }
  static Mask invert(Mask a) { return _knot_mask16(a); }
  static bool any(Mask a) { return a != 0; }
  static unsigned bits(Mask a) { return a; }
  static Mask from_bits(unsigned bits) { return static_cast<Mask>(bits); }
  static Mask first_lanes(std::uint32_t count) {
    return count < 16 ? static_cast<Mask>((1u << count) - 1) : Mask{0xffff};
  }
  static Float select(Mask m, Float a, Float b) { return _mm512_mask_blend_ps(m, b, a); }
  static Uint select(Mask m, Uint a, Uint b) { return _mm512_mask_blend_epi32(m, b, a); }

  static Mask nonzero(Uint a) { return _mm512_test_epi32_mask(a, a); }
  static Uint subtract(Uint a, Uint b) { return _mm512_sub_epi32(a, b); }
  static Mask equal(Uint a, Uint b) { return _mm512_cmpeq_epi32_mask(a, b); }
  static Uint add(Uint a, Uint b) { return _mm512_add_epi32(a, b); }
  static Uint multiply(Uint a, Uint b) { return _mm512_mullo_epi32(a, b); }
  static Uint to_uint(Float a) { return _mm512_cvttps_epi32(a); }
  /// max(0, floor(log2(a)) + offset), at most `limit`.
  static Uint level_of(Float a, int offset, int limit) {
    const Uint exponent = _mm512_srli_epi32(_mm512_castps_si512(a), 23);
    const Uint level = _mm512_sub_epi32(exponent, _mm512_set1_epi32(127 - offset));
    return _mm512_min_epi32(_mm512_max_epi32(level, _mm512_setzero_si512()), _mm512_set1_epi32(limit));
  }
  /// 2^-level and 2^level.
  static Float power_of_half(Uint level) {
    return _mm512_castsi512_ps(_mm512_slli_epi32(_mm512_sub_epi32(_mm512_set1_epi32(127), level), 23));
  }
  static Float power_of_two(Uint level) {
    return _mm512_castsi512_ps(_mm512_slli_epi32(_mm512_add_epi32(_mm512_set1_epi32(127), level), 23));
  }
  static Uint lookup(const std::uint32_t* table16, Uint index) {
    return _mm512_permutexvar_epi32(index, _mm512_loadu_si512(table16));
  }
  static Float lookup8(const float* table8, Uint index) {
    return _mm512_permutexvar_ps(index, _mm512_castps256_ps512(_mm256_loadu_ps(table8)));
  }
  static Float gather(const float* from, Uint index, Mask where) {
    return _mm512_mask_i32gather_ps(_mm512_setzero_ps(), where, index, from, 4);
  }
  static Uint gather(const std::uint32_t* from, Uint index, Mask where) {
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), where, index, from, 4);
  }
  static Float to_float(Uint a) { return _mm512_cvtepi32_ps(a); }
  static Uint shift_right(Uint a, Uint by) { return _mm512_srlv_epi32(a, by); }
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

// Eight lanes of float64.
struct WideLanes {
  static constexpr int width = 8;
  using Float = __m512d;
  using Mask = __mmask8;

  /// from[index[2 * lane]].
  static Float gather(const double* from, const std::uint32_t* index) {
    const __m512i rows = _mm512_permutexvar_epi32(_mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 0, 0, 0, 0, 0, 0, 0, 0),
                                                  _mm512_loadu_si512(index));
    return _mm512_i32gather_pd(_mm512_castsi512_si256(rows), from, 8);
  }
  static Float broadcast(double v) { return _mm512_set1_pd(v); }
  static Float add(Float a, Float b) { return _mm512_add_pd(a, b); }
  static Float subtract(Float a, Float b) { return _mm512_sub_pd(a, b); }
  static Float multiply(Float a, Float b) { return _mm512_mul_pd(a, b); }
  static Float divide(Float a, Float b) { return _mm512_div_pd(a, b); }
  static Float min(Float a, Float b) { return _mm512_min_pd(a, b); }
  static Float max(Float a, Float b) { return _mm512_max_pd(a, b); }
  static Float absolute(Float a) { return _mm512_abs_pd(a); }
  static Float floor(Float a) { return _mm512_roundscale_pd(a, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
  static Mask less_than(Float a, Float b) { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); }
  static Mask less_equal(Float a, Float b) { return _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ); }
  static Mask equal(Float a, Float b) { return _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ); }
  static Mask both(Mask a, Mask b) { return _kand_mask8(a, b); }
  static Mask either(Mask a, Mask b) { return _kor_mask8(a, b); }
  static Mask invert(Mask a) { return _knot_mask8(a); }
  static unsigned bits(Mask a) { return a; }
  static Mask from_bits(unsigned bits) { return static_cast<Mask>(bits); }
  static Float select(Mask m, Float a, Float b) { return _mm512_mask_blend_pd(m, b, a); }
  static void store_int(std::int32_t* p, Float v) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), _mm512_cvttpd_epi32(v));
  }
};
