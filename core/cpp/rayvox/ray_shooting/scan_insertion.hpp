#pragma once
// Scan insertion (Min, Han, Kim 2021, section IV-A, steps 2 to 4): the cells that rays pass and those they end in are
// marked tile by tile, and the marks update the tile's part of the octree.
#include <cstdint>
#include <memory>
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/embree_regions.hpp"
#include "rayvox/ray_shooting/scan_rays.hpp"

namespace rayvox {

/// How the cells that rays pass are found; every engine gives the same map. `automatic` takes the cheapest.
enum class Engine : std::uint8_t { automatic, dda, embree, beam };

/// What one insertion did. Times are wall-clock seconds; shoot_s and update_s are summed over threads and divided by
/// their number.
struct ScanStatistics {
  Engine engine = Engine::dda;  // the one that ran
  std::uint64_t ray_count = 0;
  std::uint64_t voxel_steps = 0;  // cells walked, each ray counted alone, and cells asked (beam)
  std::uint64_t tile_count = 0;
  std::uint64_t brick_count = 0;     // bricks marked by any ray
  std::uint64_t voxels_changed = 0;  // log-odds changed or newly known
  std::uint64_t bvh_node_count = 0;  // boxes in the Embree engine's scene
  double bvh_s = 0;                  // bringing that scene up to date
  double cut_s = 0, shoot_s = 0, update_s = 0, total_s = 0;
};

/// Adds the tiles' parts to the whole's statistics.
void add_up(const std::vector<ScanStatistics>& parts, int workers, ScanStatistics& statistics);

/// Inserts the rays into the tree under `map.root`; slots that change get `map.revision`. `regions` belong to this
/// map's writer and are made when the Embree engine first needs them; throws EngineUnavailable, with the map unchanged,
/// if Embree is not installed.
ScanStatistics insert_rays(MapSnapshot& map, const ScanRays& rays, Engine engine,
                           std::unique_ptr<EmbreeRegions>& regions);

}  // namespace rayvox
