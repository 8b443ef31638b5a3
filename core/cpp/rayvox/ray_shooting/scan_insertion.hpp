#pragma once
// Scan insertion with the exact DDA engine (Min, Han, Kim 2021, section IV-A, steps 2 to 4): every ray is cut at tile
// borders, each tile is walked by all its rays into a grid of marks, and the marks update the tile's part of the
// octree.
#include <cstdint>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/scan_rays.hpp"

namespace rayvox {

/// What one insertion did. Times are wall-clock seconds; shoot_s and update_s are summed over threads and divided by
/// their number.
struct ScanStatistics {
  std::uint64_t ray_count = 0;
  std::uint64_t voxel_steps = 0;  // cells passed, each ray counted alone
  std::uint64_t tile_count = 0;
  std::uint64_t brick_count = 0;     // bricks marked by any ray
  std::uint64_t voxels_changed = 0;  // log-odds changed or newly known
  double cut_s = 0, shoot_s = 0, update_s = 0, total_s = 0;
};

/// Inserts the rays into the tree under `map.root`; slots that change get `map.revision`.
ScanStatistics insert_rays(MapSnapshot& map, const ScanRays& rays);

}  // namespace rayvox
