#pragma once
// One lane of plain C++: the reference, and what runs where no vector set does.
#include <cstdint>

struct Lanes {
  static constexpr int width = 1;
  using Float = float;
  using Uint = std::uint32_t;
  using Mask = bool;
  static constexpr unsigned all_bits = 1;

  static Float load(const float* p) { return *p; }
  static Uint load(const std::uint32_t* p) { return *p; }
  /// The first three of every four floats from `rows`, width rows of them, by column.
  static constexpr int rows_at_once = 1;
  static void load_columns(const float* rows, const float*, Float& a, Float& b, Float& c) {
    a = rows[0];
    b = rows[1];
    c = rows[2];
  }
  static void store(float* p, Float v) { *p = v; }
  static void store(std::uint32_t* p, Uint v) { *p = v; }
  static Float broadcast(float v) { return v; }
  static Uint broadcast(std::uint32_t v) { return v; }

  static Float add(Float a, Float b) { return a + b; }
  static Float subtract(Float a, Float b) { return a - b; }
  static Float multiply(Float a, Float b) { return a * b; }
  static Float divide(Float a, Float b) { return a / b; }
  static Float multiply_add(Float a, Float b, Float c) { return a * b + c; }
  static Float min(Float a, Float b) { return a < b ? a : b; }
  static Float max(Float a, Float b) { return a > b ? a : b; }
  static Float absolute(Float a) { return __builtin_fabsf(a); }
  static Float ceil(Float a) { return __builtin_ceilf(a); }
  static Float truncate(Float a) { return static_cast<float>(static_cast<std::int32_t>(a)); }
  static float reduce_min(Float a) { return a; }
  static float reduce_max(Float a) { return a; }
  static Mask less_equal(Float a, Float b) { return a <= b; }
  static Mask less_than(Float a, Float b) { return a < b; }
  static Mask equal(Float a, Float b) { return a == b; }

  static Mask both(Mask a, Mask b) { return a && b; }
  static Mask either(Mask a, Mask b) { return a || b; }
  static Mask invert(Mask a) { return !a; }
  static bool any(Mask a) { return a; }
  static unsigned bits(Mask a) { return a; }
  static Mask from_bits(unsigned bits) { return bits & 1; }
  static Mask first_lanes(std::uint32_t count) { return count > 0; }
  static Float select(Mask m, Float a, Float b) { return m ? a : b; }
  static Uint select(Mask m, Uint a, Uint b) { return m ? a : b; }

  static Mask nonzero(Uint a) { return a != 0; }
  static Uint subtract(Uint a, Uint b) { return a - b; }
  static Mask equal(Uint a, Uint b) { return a == b; }
  static Uint add(Uint a, Uint b) { return a + b; }
  static Uint multiply(Uint a, Uint b) { return a * b; }
  static Uint to_uint(Float a) { return static_cast<Uint>(a); }
  /// max(0, floor(log2(a)) + offset), at most `limit`.
  static Uint level_of(Float a, int offset, int limit) {
    const int level = static_cast<int>(__builtin_bit_cast(Uint, a) >> 23) - 127 + offset;
    return static_cast<Uint>(level < 0 ? 0 : level > limit ? limit : level);
  }
  /// 2^-level and 2^level.
  static Float power_of_half(Uint level) { return __builtin_bit_cast(Float, (127 - level) << 23); }
  static Float power_of_two(Uint level) { return __builtin_bit_cast(Float, (127 + level) << 23); }
  static Uint lookup(const std::uint32_t* table16, Uint index) { return table16[index]; }
  static Float lookup8(const float* table8, Uint index) { return table8[index]; }
  static Float gather(const float* from, Uint index, Mask where) { return where ? from[index] : 0.0f; }
  static Uint gather(const std::uint32_t* from, Uint index, Mask where) { return where ? from[index] : 0u; }
  static Float to_float(Uint a) { return static_cast<Float>(a); }
  static Uint shift_right(Uint a, Uint by) { return a >> by; }
  static Uint decrement_where(Uint a, Mask m) { return a - m; }
  static Float increment_where(Float a, Mask m) { return m ? a + 1 : a; }
  static Uint combine(Uint a, Uint b, Uint c) { return a | b | c; }
  static Uint dilated_step(Uint p, Uint decrement, Uint mask, Mask m) { return m ? (p - decrement) & mask : p; }

  static void mark(std::uint8_t* bytes, Uint index) { bytes[index] = 1; }
};

// One lane of float64.
struct WideLanes {
  static constexpr int width = 1;
  using Float = double;
  using Mask = bool;

  /// from[index[2 * lane]].
  static Float gather(const double* from, const std::uint32_t* index) { return from[index[0]]; }
  static Float broadcast(double v) { return v; }
  static Float add(Float a, Float b) { return a + b; }
  static Float subtract(Float a, Float b) { return a - b; }
  static Float multiply(Float a, Float b) { return a * b; }
  static Float divide(Float a, Float b) { return a / b; }
  static Float min(Float a, Float b) { return a < b ? a : b; }
  static Float max(Float a, Float b) { return a > b ? a : b; }
  static Float absolute(Float a) { return __builtin_fabs(a); }
  static Float floor(Float a) { return __builtin_floor(a); }
  static Mask less_than(Float a, Float b) { return a < b; }
  static Mask less_equal(Float a, Float b) { return a <= b; }
  static Mask equal(Float a, Float b) { return a == b; }
  static Mask both(Mask a, Mask b) { return a && b; }
  static Mask either(Mask a, Mask b) { return a || b; }
  static Mask invert(Mask a) { return !a; }
  static unsigned bits(Mask a) { return a; }
  static Mask from_bits(unsigned bits) { return bits & 1; }
  static Float select(Mask m, Float a, Float b) { return m ? a : b; }
  static void store_int(std::int32_t* p, Float v) { *p = static_cast<std::int32_t>(v); }
};
