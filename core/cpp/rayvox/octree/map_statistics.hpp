#pragma once
#include <cstddef>
#include <cstdint>

#include "rayvox/octree/box.hpp"
#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

struct MapStatistics {
  std::uint64_t occupied_leaves = 0, free_leaves = 0;
  std::uint64_t nodes = 0;                           // leaves and inner nodes, as OctoMap counts them
  std::uint64_t occupied_cells = 0, free_cells = 0;  // leaves in finest-level cells
  CellBox known{{0, 0, 0}, {-1, -1, -1}};            // bounds of the known cells; empty for an empty map
};

MapStatistics statistics_of(const MapSnapshot& map);

/// Bytes held by the snapshot's nodes and bricks; what it shares with others is counted too.
std::size_t memory_bytes(const MapSnapshot& map);

}  // namespace rayvox
