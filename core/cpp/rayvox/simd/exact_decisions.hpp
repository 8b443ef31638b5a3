#pragma once
// The doors from the per-instruction-set kernels back to exact arithmetic.
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// Of the candidate axes, those by which ray `ray` of the tile leaves `cell` first (crossing_order.hpp).
std::uint8_t settle_tie(const TileSegments& tile, std::uint32_t ray, const std::int32_t cell[3],
                        std::uint8_t candidates);

/// Whether the ray passes the cell before its end's cell.
bool passes_cell(const BeamScan& scan, std::uint32_t ray, const std::int32_t cell[3]);

/// The ray's segment in the block; false if it passes none of its cells before its end's.
bool clip_exactly(const BeamScan& scan, const CellBlock& block, std::uint32_t ray, Segment& segment);

}  // namespace rayvox
