#pragma once
// Which parts of the octree can a ray still change? (DESIGN: model only what a scene requires.) A miss changes a cell
// unless it is known and at the lower clamping bound, so space of which that is true for all cells needs no ray.
#include <cstdint>
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// A box of cells that rays may have to pass: `size` cells from `low` on, inside one octree node of that level.
struct ChangeableBox {
  Cell low, size;
  std::int32_t level;

  bool operator==(const ChangeableBox&) const = default;
  /// The node's first cell.
  Cell node() const { return {low[0] >> level << level, low[1] >> level << level, low[2] >> level << level}; }
};

/// What of one tile is changeable: per octant (4x4x4 cells, Morton order) the slices along each axis that hold such a
/// cell. The box between the outermost slices is what rays are tested against; at a wall it is as thin as the wall.
class ChangeableOctants {
 public:
  /// Those below a tile's slot.
  static ChangeableOctants of(const Child& slot, int tile_level, float clamp_min_log_odds, const Kernels& kernels);

  bool contains(const ChangeableOctants& other) const;
  /// Octants with any changeable cell.
  int count() const;
  ChangeableOctants& operator|=(const ChangeableOctants& other);
  /// Their boxes; nodes that are changeable throughout are one.
  std::vector<ChangeableBox> boxes(const Cell& tile, int tile_level) const;

 private:
  using Slices = std::uint16_t;  // bits 0 to 3: x, 4 to 7: y, 8 to 11: z
  static constexpr Slices all_slices = 0xfff;
  struct Collector;
  struct Splitter;

  static Slices slices_of(std::uint64_t cells);

  Slices octants_[bricks_per_tile * 8] = {};
};

}  // namespace rayvox
