#pragma once
// What a scan frees in one tile, found from the cells' side: only cells that a miss would still change are asked, and
// only where rays can reach them. Where that is dearer than walking the rays through the tile, they are walked.
#include <cstdint>
#include <optional>
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/octree/tile_update.hpp"
#include "rayvox/ray_shooting/scan_rays.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// Which cells of a tile a scan frees and which it hits, a bit each in Morton order. All zero between uses.
struct TileMasks {
  std::uint64_t free[tile_cells / 64], occupied[tile_cells / 64];
};

/// One worker's scratch memory.
struct BeamScratch {
  struct WantedBrick {
    CellBlock block;
    std::uint32_t brick;      // Morton code within the tile, in bricks
    std::uint64_t wanted[8];  // cells that a miss would change, a word per octant
  };
  std::vector<WantedBrick> bricks;
  ScanRays::Array<Segment> segments;
  TileMasks masks;
  TileMarks marks;
};

class BeamShooter {
 public:
  BeamShooter(const BeamScan& scan, std::size_t ray_count, const MapSnapshot& map, const Kernels& kernels)
      : scan_(scan), ray_count_(ray_count), map_(map), kernels_(kernels) {}

  /// Morton codes (in tiles, ascending) of the tiles of this level that rays reach and in which a miss would change
  /// something. Nothing once they are more than `most`: rays so sparse that the bins between them fill with tiles none
  /// passes.
  std::optional<std::vector<std::uint64_t>> tiles_to_shoot(int tile_level, std::size_t most) const;
  /// Sets the free bits of the cells of one tile that rays pass, save some of those that a miss leaves as they are.
  /// Returns how many cells were asked or walked.
  std::uint64_t shoot_tile(std::uint64_t tile, const OpenTile& open, BeamScratch& scratch) const;

 private:
  bool is_wanted(const Child* slot, const Cell& first, int level) const;
  void list_tiles(const Child* slot, const Cell& first, int level, int tile_level, std::size_t most,
                  std::vector<std::uint64_t>& tiles) const;
  std::uint64_t collect(const Child* slot, const Cell& first, int level, std::uint32_t brick, std::uint64_t most,
                        std::vector<BeamScratch::WantedBrick>& bricks) const;
  std::uint64_t walk_rays(const CellBlock& tile, BeamScratch& scratch) const;
  std::uint64_t changeable_cells(const Child* slot, int octant) const;

  const BeamScan& scan_;
  const std::size_t ray_count_;
  const MapSnapshot& map_;
  const Kernels& kernels_;
};

}  // namespace rayvox
