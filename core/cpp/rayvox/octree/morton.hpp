#pragma once
// Morton (Z-order) codes: bit 3i is x's bit i, 3i+1 y's, 3i+2 z's. A node's child index (x + 2y + 4z, OctoMap's order)
// is then three consecutive bits, so a range sorted by Morton code is sorted the way the octree is traversed.
#include <cstdint>

#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// Spreads the low 21 bits of v to every third bit.
constexpr std::uint64_t spread_bits(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffff;
  v = (v | v << 16) & 0x1f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f;
  v = (v | v << 4) & 0x10c30c30c30c30c3;
  v = (v | v << 2) & 0x1249249249249249;
  return v;
}

/// Inverse of spread_bits.
constexpr std::uint32_t gather_bits(std::uint64_t v) {
  v &= 0x1249249249249249;
  v = (v | v >> 2) & 0x10c30c30c30c30c3;
  v = (v | v >> 4) & 0x100f00f00f00f00f;
  v = (v | v >> 8) & 0x1f0000ff0000ff;
  v = (v | v >> 16) & 0x1f00000000ffff;
  v = (v | v >> 32) & 0x1fffff;
  return static_cast<std::uint32_t>(v);
}

/// Morton code of unsigned cell coordinates below 2^21.
constexpr std::uint64_t morton_encode(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}

constexpr std::uint32_t morton_x(std::uint64_t code) { return gather_bits(code); }
constexpr std::uint32_t morton_y(std::uint64_t code) { return gather_bits(code >> 1); }
constexpr std::uint32_t morton_z(std::uint64_t code) { return gather_bits(code >> 2); }

}  // namespace rayvox
