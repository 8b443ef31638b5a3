#pragma once
// IEEE 754 binary16 for slabs.
#include <cmath>
#include <cstdint>
#include <cstring>

namespace rayvox {

inline float half_to_float(std::uint16_t half) {
  const float sign = half & 0x8000 ? -1.0f : 1.0f;
  const int exponent = half >> 10 & 31, mantissa = half & 1023;
  if (exponent == 31) return mantissa ? NAN : sign * INFINITY;
  return exponent == 0 ? sign * std::ldexp(static_cast<float>(mantissa), -24)
                       : sign * std::ldexp(static_cast<float>(1024 + mantissa), exponent - 25);
}

/// The smallest half that is not below `value`; infinity above 65504.
inline std::uint16_t half_not_below(float value) {
  if (value > 65504.0f) return 0x7c00;
  if (value < -65504.0f) return value == -INFINITY ? 0xfc00 : 0xfbff;
  const bool negative = value < 0;
  const float magnitude = std::abs(value);
  int exponent = 0;
  std::frexp(magnitude, &exponent);
  if (exponent < -13) exponent = -13;  // subnormal halves share one spacing
  // In units of the last place: away from zero for positive values, towards it for negative ones.
  const float units = std::ldexp(magnitude, 11 - exponent);
  const auto count = static_cast<std::uint32_t>(negative ? std::floor(units) : std::ceil(units));
  const std::uint32_t bits = count < 1024 ? count : static_cast<std::uint32_t>(exponent + 13) * 1024 + count;
  return static_cast<std::uint16_t>((negative ? 0x8000u : 0u) | bits);
}

}  // namespace rayvox
