#pragma once
// Which parts of the octree can a ray still change? (DESIGN: model only what a scene requires.) A miss changes a cell
// unless it is known and at the lower clamping bound, so space of which that is true for all cells needs no ray.
#include <cstdint>
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

constexpr int octant_level = 2;

/// An octree node with changeable cells: wholly changeable, or an octant with a bit for each such cell (Morton order).
struct ChangeableNode {
  Cell first;
  std::int32_t level;
  std::uint64_t cells;

  bool operator==(const ChangeableNode&) const = default;
};

/// Cells [low, low + size) of an octant, counted from its first.
struct OctantBox {
  std::int32_t low[3], size[3];
};
/// The smallest box around some cells of an octant (a bit each, at least one).
OctantBox box_around(std::uint64_t cells);

/// The changeable cells of one tile.
class ChangeableCells {
 public:
  /// Those below a tile's slot.
  static ChangeableCells of(const Child& slot, int tile_level, float clamp_min_log_odds, const Kernels& kernels);

  bool contains(const ChangeableCells& other) const;
  /// Octants with any changeable cell.
  int octant_count() const;
  ChangeableCells& operator|=(const ChangeableCells& other);
  /// As few nodes as hold them.
  std::vector<ChangeableNode> nodes(const Cell& tile, int tile_level) const;

 private:
  struct Collector;
  struct Splitter;

  std::uint64_t octants_[bricks_per_tile * 8] = {};
};

}  // namespace rayvox
