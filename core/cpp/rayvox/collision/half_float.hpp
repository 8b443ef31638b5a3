#pragma once
// IEEE 754 binary16 for slabs.
#include <bit>
#include <cmath>
#include <cstdint>

namespace rayvox {

inline float half_to_float(std::uint16_t half) {
  // The exponent moves from a bias of 15 to one of 127, which a product does for subnormal halves too.
  const std::uint32_t magnitude = (half & 0x7fffu) << 13;
  const float value = magnitude >= 0x0f800000u ? std::bit_cast<float>(magnitude | 0x7f800000u)
                                               : std::bit_cast<float>(magnitude) * 0x1p112f;
  return half & 0x8000 ? -value : value;
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
