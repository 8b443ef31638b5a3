#pragma once
// One lane of plain C++ for bounding volumes and triangles: the reference, and what runs where no vector set does.
#include <cstdint>

struct CollisionLanes {
  static constexpr int width = 1;
  using Float = float;
  using Mask = bool;

  static Float load(const float* p) { return *p; }
  static Float load(const std::uint16_t* p) {
    // The exponent moves from a bias of 15 to one of 127, which a product does for subnormal halves too.
    const std::uint32_t magnitude = (*p & 0x7fffu) << 13, sign = (*p & 0x8000u) << 16;
    std::uint32_t bits = magnitude >= 0x0f800000u ? magnitude | 0x7f800000u : magnitude;
    float value;
    __builtin_memcpy(&value, &bits, sizeof value);
    if (magnitude < 0x0f800000u) value *= 0x1p112f;
    __builtin_memcpy(&bits, &value, sizeof bits);
    bits |= sign;
    __builtin_memcpy(&value, &bits, sizeof value);
    return value;
  }
  static Float load(const std::int16_t* p) { return static_cast<float>(*p); }
  static void store(float* p, Float v) { *p = v; }
  static Float broadcast(float v) { return v; }

  static Float add(Float a, Float b) { return a + b; }
  static Float subtract(Float a, Float b) { return a - b; }
  static Float multiply(Float a, Float b) { return a * b; }
  static Float divide(Float a, Float b) { return a / b; }
  static Float multiply_add(Float a, Float b, Float c) { return a * b + c; }
  static Float multiply_subtract(Float a, Float b, Float c) { return a * b - c; }
  static Float min(Float a, Float b) { return a < b ? a : b; }
  static Float max(Float a, Float b) { return a > b ? a : b; }
  static Float abs(Float a) { return __builtin_fabsf(a); }

  /// The least of `value` and the lanes of `v` that are set in `lanes`.
  static float least(float value, Float v, unsigned) { return v < value ? v : value; }

  static Mask greater(Float a, Float b) { return a > b; }
  static Mask not_less(Float a, Float b) { return a >= b; }
  static Float select(Mask m, Float a, Float b) { return m ? a : b; }
  static unsigned bits(Mask m) { return m; }
  static Mask both(Mask a, Mask b) { return a && b; }
  static Mask either(Mask a, Mask b) { return a || b; }
  static Mask first(int n) { return n > 0; }

  /// table[index[lane]].
  static Float lookup(const float* table, int, const std::int32_t* index) { return table[*index]; }
  /// `size` values, to be looked up by index.
  template <int size>
  struct Table {
    const std::int16_t* value;
    explicit Table(const std::int16_t* values) : value(values) {}
    Float lookup(const std::int32_t* index) const { return static_cast<float>(value[*index]); }
  };
  /// out[c] = row[0][first + c].
  static void load_transposed(const float* const* row, int first, Float* out) {
    for (int c = 0; c < 4; ++c) out[c] = row[0][first + c];
  }
  /// The numbers of the set bits to `b_out`, and `a` as often to `a_out`; room for sixteen.
  static void store_set_bits(unsigned bits, std::int32_t a, std::int32_t* a_out, std::int32_t* b_out) {
    for (; bits; bits &= bits - 1) {
      *a_out++ = a;
      *b_out++ = __builtin_ctz(bits);
    }
  }
  static float half_value(std::uint16_t half) { return load(&half); }

  struct Four {
    float value[4];
  };
  template <class Slab>
  static Four load_four(const Slab* p) {
    return {{load(p), load(p + 1), load(p + 2), load(p + 3)}};
  }
  static Four multiply_add(float s, const Four& b, const Four& c) {
    return {{s * b.value[0] + c.value[0], s * b.value[1] + c.value[1], s * b.value[2] + c.value[2],
             s * b.value[3] + c.value[3]}};
  }
  static Four broadcast_four(float s) { return {{s, s, s, s}}; }
  /// Value block / 4, and block % 4: the one lane of sixteen (SIMDop, Fig. 4).
  static Float spread(const Four& v, int block) { return v.value[block / 4]; }
  static Float repeat(const Four& v, int block) { return v.value[block % 4]; }
};
