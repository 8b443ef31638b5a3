#pragma once
// Rays cut at tile borders and binned by tile, so that each tile is walked and updated by one thread, in its cache,
// with no lock.
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "rayvox/octree/map_geometry.hpp"
#include "rayvox/ray_shooting/scan_rays.hpp"
#include "rayvox/ray_shooting/segment.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// What one worker found for one tile.
struct TileBin {
  std::uint64_t tile = 0;  // Morton code of the tile's lowest cell, shifted right by 3 * its level
  std::vector<Segment> segments;
  std::vector<std::uint32_t> ends;  // Morton codes, within the tile, of cells that hold an end point
  std::uint64_t crossings = 0;
};

class TileAddresses;

/// One worker's bins.
class TileBins {
 public:
  void clear();
  /// Cuts rays [first, last) exactly at tile borders.
  void add_rays(const ScanRays& rays, std::size_t first, std::size_t last, const MapGeometry& geometry);
  /// Bins the end points of rays [first, last) by tiles of 2^tile_level cells a side.
  void add_ends(const ScanRays& rays, std::size_t first, std::size_t last, const MapGeometry& geometry, int tile_level);
  /// One part of a ray inside the tile of `from`, the cell where it starts.
  void add_segment(std::size_t ray, const Cell& from, int crossings, const MapGeometry& geometry);
  /// The parts of a packet's rays inside a box of one tile that starts at `box`.
  void add_segments(const std::uint32_t* ray_of_lane, const PassedBox& passed, const Cell& box,
                    const MapGeometry& geometry);
  const std::vector<TileBin>& bins() const { return bins_; }
  /// Bytes held, spare memory included.
  std::size_t bytes() const;

 private:
  TileBin& bin_of(std::uint64_t name);

  void add_bin(std::uint64_t name);

  std::vector<TileBin> bins_;
  std::vector<TileBin> spare_;                              // emptied bins whose memory the next scan reuses
  std::unordered_map<std::uint64_t, std::uint32_t> index_;  // by TileAddresses::name
  // Neighbouring rays cross the same few tiles: a direct-mapped cache in front of the hash table.
  struct Recent {
    std::uint64_t tile = ~std::uint64_t{0};
    std::uint32_t index = 0;
  };
  Recent recent_[256];
};

/// A tile's bins of all workers.
struct TileWork {
  std::uint64_t tile = 0;
  std::vector<const TileBin*> bins;
  std::uint64_t crossings = 0;
};

/// All workers' bins by tile, in Morton order.
std::vector<TileWork> gather_tiles(const std::vector<TileBins>& workers);

}  // namespace rayvox
