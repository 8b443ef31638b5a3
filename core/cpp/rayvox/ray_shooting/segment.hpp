#pragma once
#include <cstddef>
#include <cstdint>

namespace rayvox {

/// The part of a ray inside one tile: where it starts (Morton code within the tile) and how many borders it crosses
/// from there, the one by which it leaves the tile included. The cells before each crossing are those it frees.
struct Segment {
  std::uint32_t ray;
  std::uint32_t start_and_crossings;  // 18 and 14 bits

  static Segment make(std::size_t ray, std::uint64_t start, int crossings) {
    return {static_cast<std::uint32_t>(ray), static_cast<std::uint32_t>(start) | static_cast<std::uint32_t>(crossings)
                                                                                     << 18};
  }
};
static_assert(sizeof(Segment) == 8);

}  // namespace rayvox
