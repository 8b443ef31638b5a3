#pragma once
// Which parts of the octree can a ray still change? (DESIGN: model only what a scene requires.) A miss changes a cell
// unless it is known and at the lower clamping bound, so space of which that is true for all cells needs no ray.
#include <cstdint>
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// An octree node that rays may have to pass: 2^level cells from `first` on.
struct ChangeableNode {
  Cell first;
  std::int32_t level;

  bool operator==(const ChangeableNode&) const = default;
};

/// Nodes of 16x16x16 cells are the finest that rays are tested against: smaller ones save steps of the DDA, but their
/// tests cost more than the steps (benchmarks/RESULTS.md).
constexpr int finest_changeable_level = 4;

/// Whether a miss would change any cell below the slot.
bool is_changeable(const Child& slot, float clamp_min_log_odds);

/// The changeable nodes of the finest level in one tile, a bit for each, in Morton order.
std::uint64_t changeable_blocks(const Child& slot, int tile_level, float clamp_min_log_odds);

/// As few nodes as make up these blocks of a tile.
std::vector<ChangeableNode> nodes_of_blocks(std::uint64_t blocks, const Cell& tile, int tile_level);

}  // namespace rayvox
