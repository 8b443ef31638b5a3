#pragma once
// The update side of an insertion: opens the paths to all tiles, lets each tile be updated on its own, closes the
// paths.
#include <cstdint>
#include <span>
#include <vector>

#include "rayvox/octree/brick_update.hpp"
#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// One brick's marks; `brick` is its Morton code within the tile, in bricks.
struct MarkedBrick {
  std::uint32_t brick;
  BrickMarks marks;
};

/// A tile's slot, owned by the map alone while it is open.
struct OpenTile {
  int level = 0;
  Child* slot = nullptr;
  std::uint64_t* slot_revision = nullptr;
};

/// Opens every node above the given tiles of 2^tile_level cells a side (ascending Morton codes, in tiles). Distinct
/// tiles may then be updated by distinct threads.
std::vector<OpenTile> open_tiles(MapSnapshot& map, std::span<const std::uint64_t> tiles, int tile_level);

/// Applies the marks (ascending brick codes) below one open tile; returns the number of cells changed.
std::uint64_t update_tile(const OpenTile& tile, std::span<const MarkedBrick> bricks, const MapSnapshot& map,
                          const Kernels& kernels);

/// Prunes and summarises the nodes above the tiles again.
void close_tiles(MapSnapshot& map, std::span<const std::uint64_t> tiles, int tile_level);

}  // namespace rayvox
