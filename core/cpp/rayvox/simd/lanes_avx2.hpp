#pragma once
// Eight lanes of AVX2. A mask is a vector of all-ones or all-zeros lanes.
#include <immintrin.h>

#include <cstdint>

struct Lanes {
  static constexpr int width = 8;
  using Float = __m256;
  using Uint = __m256i;
  using Mask = __m256;
  static constexpr unsigned all_bits = 0xff;

  static Float load(const float* p) { return _mm256_loadu_ps(p); }
  static Uint load(const std::uint32_t* p) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); }
  /// The first three of every four floats from `rows`, width rows of them, by column.
  static constexpr int rows_at_once = 1;
  static void load_columns(const float* rows, const float*, Float& a, Float& b, Float& c) {
    const __m256i row = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
    a = _mm256_i32gather_ps(rows, row, 4);
    b = _mm256_i32gather_ps(rows + 1, row, 4);
    c = _mm256_i32gather_ps(rows + 2, row, 4);
  }
  static void store(float* p, Float v) { _mm256_storeu_ps(p, v); }
  static void store(std::uint32_t* p, Uint v) { _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), v); }
  static Float broadcast(float v) { return _mm256_set1_ps(v); }
  static Uint broadcast(std::uint32_t v) { return _mm256_set1_epi32(static_cast<int>(v)); }

  static Float add(Float a, Float b) { return _mm256_add_ps(a, b); }
  static Float subtract(Float a, Float b) { return _mm256_sub_ps(a, b); }
  static Float multiply(Float a, Float b) { return _mm256_mul_ps(a, b); }
  static Float divide(Float a, Float b) { return _mm256_div_ps(a, b); }
  static Float multiply_add(Float a, Float b, Float c) { return _mm256_fmadd_ps(a, b, c); }
  static Float min(Float a, Float b) { return _mm256_min_ps(a, b); }
  static Float max(Float a, Float b) { return _mm256_max_ps(a, b); }
  static Float absolute(Float a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
  static Float ceil(Float a) { return _mm256_ceil_ps(a); }
  static Float truncate(Float a) { return _mm256_round_ps(a, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
  static float reduce_min(Float a) {
    const __m128 half = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    const __m128 pair = _mm_min_ps(half, _mm_movehl_ps(half, half));
    return _mm_cvtss_f32(_mm_min_ss(pair, _mm_shuffle_ps(pair, pair, 1)));
  }
  static float reduce_max(Float a) {
    const __m128 half = _mm_max_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    const __m128 pair = _mm_max_ps(half, _mm_movehl_ps(half, half));
    return _mm_cvtss_f32(_mm_max_ss(pair, _mm_shuffle_ps(pair, pair, 1)));
  }
  static Mask less_equal(Float a, Float b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
  static Mask less_than(Float a, Float b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
  static Mask equal(Float a, Float b) { return _mm256_cmp_ps(a, b, _CMP_EQ_OQ); }

  static Mask both(Mask a, Mask b) { return _mm256_and_ps(a, b); }
  static Mask either(Mask a, Mask b) { return _mm256_or_ps(a, b); }
  static Mask invert(Mask a) { return _mm256_xor_ps(a, _mm256_castsi256_ps(_mm256_set1_epi32(-1))); }
  static bool any(Mask a) { return _mm256_movemask_ps(a) != 0; }
  static unsigned bits(Mask a) { return static_cast<unsigned>(_mm256_movemask_ps(a)); }
  static Mask from_bits(unsigned bits) {
    const __m256i lane_bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i set = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), lane_bit);
    return _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane_bit));
  }
  static Mask first_lanes(std::uint32_t count) { return from_bits(count < 8 ? (1u << count) - 1 : 0xffu); }
  static Float select(Mask m, Float a, Float b) { return _mm256_blendv_ps(b, a, m); }
  static Uint select(Mask m, Uint a, Uint b) { return _mm256_blendv_epi8(b, a, _mm256_castps_si256(m)); }

  static Mask nonzero(Uint a) { return invert(_mm256_castsi256_ps(_mm256_cmpeq_epi32(a, _mm256_setzero_si256()))); }
  static Uint subtract(Uint a, Uint b) { return _mm256_sub_epi32(a, b); }
  static Mask equal(Uint a, Uint b) { return _mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b)); }
  static Uint add(Uint a, Uint b) { return _mm256_add_epi32(a, b); }
  static Uint multiply(Uint a, Uint b) { return _mm256_mullo_epi32(a, b); }
  static Uint to_uint(Float a) { return _mm256_cvttps_epi32(a); }
  /// max(0, floor(log2(a)) + offset), at most `limit`.
  static Uint level_of(Float a, int offset, int limit) {
    const Uint exponent = _mm256_srli_epi32(_mm256_castps_si256(a), 23);
    const Uint level = _mm256_sub_epi32(exponent, _mm256_set1_epi32(127 - offset));
    return _mm256_min_epi32(_mm256_max_epi32(level, _mm256_setzero_si256()), _mm256_set1_epi32(limit));
  }
  /// 2^-level and 2^level.
  static Float power_of_half(Uint level) {
    return _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_sub_epi32(_mm256_set1_epi32(127), level), 23));
  }
  static Float power_of_two(Uint level) {
    return _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_add_epi32(_mm256_set1_epi32(127), level), 23));
  }
  static Uint lookup(const std::uint32_t* table16, Uint index) {
    return _mm256_i32gather_epi32(reinterpret_cast<const int*>(table16), index, 4);
  }
  static Float lookup8(const float* table8, Uint index) {
    return _mm256_permutevar8x32_ps(_mm256_loadu_ps(table8), index);
  }
  static Float gather(const float* from, Uint index, Mask where) {
    return _mm256_mask_i32gather_ps(_mm256_setzero_ps(), from, index, where, 4);
  }
  static Uint gather(const std::uint32_t* from, Uint index, Mask where) {
    return _mm256_mask_i32gather_epi32(_mm256_setzero_si256(), reinterpret_cast<const int*>(from), index,
                                       _mm256_castps_si256(where), 4);
  }
  static Float to_float(Uint a) { return _mm256_cvtepi32_ps(a); }
  static Uint shift_right(Uint a, Uint by) { return _mm256_srlv_epi32(a, by); }
  static Uint decrement_where(Uint a, Mask m) { return _mm256_add_epi32(a, _mm256_castps_si256(m)); }
  static Float increment_where(Float a, Mask m) { return _mm256_add_ps(a, _mm256_and_ps(m, _mm256_set1_ps(1.0f))); }
  static Uint combine(Uint a, Uint b, Uint c) { return _mm256_or_si256(a, _mm256_or_si256(b, c)); }
  static Uint dilated_step(Uint p, Uint decrement, Uint mask, Mask m) {
    return select(m, _mm256_and_si256(_mm256_sub_epi32(p, decrement), mask), p);
  }

  static void mark(std::uint8_t* bytes, Uint index) {
    alignas(32) std::uint32_t at[width];
    _mm256_store_si256(reinterpret_cast<__m256i*>(at), index);
    // Reloading each index costs a load port; extracting it from the register would cost two vector ports.
    asm("" : "+m"(at));
    for (int lane = 0; lane < width; ++lane) bytes[at[lane]] = 1;
  }
};

// Four lanes of float64.
struct WideLanes {
  static constexpr int width = 4;
  using Float = __m256d;
  using Mask = __m256d;

  /// from[index[2 * lane]].
  static Float gather(const double* from, const std::uint32_t* index) {
    return _mm256_setr_pd(from[index[0]], from[index[2]], from[index[4]], from[index[6]]);
  }
  static Float broadcast(double v) { return _mm256_set1_pd(v); }
  static Float add(Float a, Float b) { return _mm256_add_pd(a, b); }
  static Float subtract(Float a, Float b) { return _mm256_sub_pd(a, b); }
  static Float multiply(Float a, Float b) { return _mm256_mul_pd(a, b); }
  static Float divide(Float a, Float b) { return _mm256_div_pd(a, b); }
  static Float min(Float a, Float b) { return _mm256_min_pd(a, b); }
  static Float max(Float a, Float b) { return _mm256_max_pd(a, b); }
  static Float absolute(Float a) { return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a); }
  static Float floor(Float a) { return _mm256_floor_pd(a); }
  static Mask less_than(Float a, Float b) { return _mm256_cmp_pd(a, b, _CMP_LT_OQ); }
  static Mask less_equal(Float a, Float b) { return _mm256_cmp_pd(a, b, _CMP_LE_OQ); }
  static Mask equal(Float a, Float b) { return _mm256_cmp_pd(a, b, _CMP_EQ_OQ); }
  static Mask both(Mask a, Mask b) { return _mm256_and_pd(a, b); }
  static Mask either(Mask a, Mask b) { return _mm256_or_pd(a, b); }
  static Mask invert(Mask a) { return _mm256_xor_pd(a, _mm256_castsi256_pd(_mm256_set1_epi64x(-1))); }
  static unsigned bits(Mask a) { return static_cast<unsigned>(_mm256_movemask_pd(a)); }
  static Mask from_bits(unsigned bits) {
    const __m256i lane_bit = _mm256_setr_epi64x(1, 2, 4, 8);
    const __m256i set = _mm256_and_si256(_mm256_set1_epi64x(bits), lane_bit);
    return _mm256_castsi256_pd(_mm256_cmpeq_epi64(set, lane_bit));
  }
  static Float select(Mask m, Float a, Float b) { return _mm256_blendv_pd(b, a, m); }
  static void store_int(std::int32_t* p, Float v) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(p), _mm256_cvttpd_epi32(v));
  }
};
