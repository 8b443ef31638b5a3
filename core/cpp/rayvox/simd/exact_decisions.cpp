#include "rayvox/simd/exact_decisions.hpp"

#include <cstdlib>

#include "rayvox/octree/morton.hpp"
#include "rayvox/ray_shooting/crossing_order.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"

namespace rayvox {

std::uint8_t settle_tie(const TileSegments& tile, std::uint32_t ray, const std::int32_t cell[3],
                        std::uint8_t candidates) {
  const Ray exact{{tile.origin[0], tile.origin[1], tile.origin[2]},
                  {tile.end[0][ray], tile.end[1][ray], tile.end[2][ray]}};
  return first_axes_to_leave(exact, {cell[0], cell[1], cell[2]}, candidates);
}

bool passes_cell(const BeamScan& scan, std::uint32_t ray, const std::int32_t cell[3]) {
  const Ray exact{{scan.origin[0], scan.origin[1], scan.origin[2]},
                  {scan.end[0][ray], scan.end[1][ray], scan.end[2][ray]}};
  return passes_before_end(exact, {cell[0], cell[1], cell[2]});
}

bool clip_exactly(const BeamScan& scan, const CellBlock& block, std::uint32_t ray, Segment& segment) {
  RayWalker walker(
      {{scan.origin[0], scan.origin[1], scan.origin[2]}, {scan.end[0][ray], scan.end[1][ray], scan.end[2][ray]}});
  const auto in_block = [&](const Cell& cell) {
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis)
      inside = inside && cell[axis] >> block.level == block.cell[axis] >> block.level;
    return inside;
  };
  while (!in_block(walker.cell())) {
    if (walker.end_in_block(block.level)) return false;
    walker.leave_block(block.level);
  }
  const Cell before = walker.cell();
  const bool ends = walker.end_in_block(block.level);
  if (!ends) walker.leave_block(block.level);
  const Cell& after = ends ? walker.end_cell() : walker.cell();
  const int crossings =
      std::abs(after[0] - before[0]) + std::abs(after[1] - before[1]) + std::abs(after[2] - before[2]);
  const std::uint64_t start = morton_encode(static_cast<std::uint32_t>(before[0] - block.cell[0]),
                                            static_cast<std::uint32_t>(before[1] - block.cell[1]),
                                            static_cast<std::uint32_t>(before[2] - block.cell[2]));
  segment = Segment::make(ray, start, crossings);
  return crossings > 0;
}

}  // namespace rayvox
