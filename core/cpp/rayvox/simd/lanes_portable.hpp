#pragma once
// One lane of plain C++: the reference, and what runs where no vector set does.
#include <cstdint>

struct Lanes {
  static constexpr int width = 1;
  using Float = float;
  using Uint = std::uint32_t;
  using Mask = bool;

  static Float load(const float* p) { return *p; }
  static Uint load(const std::uint32_t* p) { return *p; }
  static void store(float* p, Float v) { *p = v; }
  static void store(std::uint32_t* p, Uint v) { *p = v; }
  static Float broadcast(float v) { return v; }
  static Uint broadcast(std::uint32_t v) { return v; }

  static Float add(Float a, Float b) { return a + b; }
  static Float multiply_add(Float a, Float b, Float c) { return a * b + c; }
  static Float min(Float a, Float b) { return a < b ? a : b; }
  static Float max(Float a, Float b) { return a > b ? a : b; }
  static Float truncate(Float a) { return static_cast<float>(static_cast<std::int32_t>(a)); }
  static float reduce_min(Float a) { return a; }
  static float reduce_max(Float a) { return a; }
  static Mask less_equal(Float a, Float b) { return a <= b; }
  static Mask equal(Float a, Float b) { return a == b; }

  static Mask both(Mask a, Mask b) { return a && b; }
  static Mask either(Mask a, Mask b) { return a || b; }
  static Mask invert(Mask a) { return !a; }
  static bool any(Mask a) { return a; }
  static unsigned bits(Mask a) { return a; }
  static Mask from_bits(unsigned bits) { return bits & 1; }
  static Float select(Mask m, Float a, Float b) { return m ? a : b; }
  static Uint select(Mask m, Uint a, Uint b) { return m ? a : b; }

  static Mask nonzero(Uint a) { return a != 0; }
  static Uint subtract(Uint a, Uint b) { return a - b; }
  static Uint decrement_where(Uint a, Mask m) { return a - m; }
  static Float increment_where(Float a, Mask m) { return m ? a + 1 : a; }
  static Uint combine(Uint a, Uint b, Uint c) { return a | b | c; }
  static Uint dilated_step(Uint p, Uint decrement, Uint mask, Mask m) { return m ? (p - decrement) & mask : p; }

  static void mark(std::uint8_t* bytes, Uint index) { bytes[index] = 1; }
};
