#pragma once
// The door from the per-instruction-set kernels back to exact arithmetic.
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// Of the candidate axes, those by which ray `ray` of the tile leaves `cell` first (crossing_order.hpp).
std::uint8_t settle_tie(const TileSegments& tile, std::uint32_t ray, const std::int32_t cell[3],
                        std::uint8_t candidates);

}  // namespace rayvox
