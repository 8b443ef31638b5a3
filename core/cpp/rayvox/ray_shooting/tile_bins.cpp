#include "rayvox/ray_shooting/tile_bins.hpp"

#include <algorithm>
#include <cstdlib>

#include "rayvox/ray_shooting/ray_walker.hpp"

namespace rayvox {

void TileBins::clear() {
  bins_.clear();
  index_.clear();
  std::fill(std::begin(recent_), std::end(recent_), Recent{});
}

TileBin& TileBins::bin_of(std::uint64_t tile) {
  Recent& recent = recent_[tile & 255];
  if (recent.tile != tile) {
    const auto [entry, added] = index_.try_emplace(tile, static_cast<std::uint32_t>(bins_.size()));
    if (added) bins_.emplace_back().tile = tile;
    recent = {tile, entry->second};
  }
  return bins_[recent.index];
}

void TileBins::add(const ScanRays& rays, std::size_t first, std::size_t last, const MapGeometry& geometry) {
  const int level = geometry.tile_level();
  const std::uint64_t within_tile = (std::uint64_t{1} << (3 * level)) - 1;
  for (std::size_t ray = first; ray < last; ++ray) {
    RayWalker walker(rays[ray]);
    for (bool last_tile = false; !last_tile;) {
      const std::uint64_t start = geometry.morton_of(walker.cell());
      const Cell before = walker.cell();
      last_tile = walker.end_in_block(level);
      if (!last_tile) walker.leave_block(level);
      const Cell& after = last_tile ? walker.end_cell() : walker.cell();
      const int crossings =
          std::abs(after[0] - before[0]) + std::abs(after[1] - before[1]) + std::abs(after[2] - before[2]);
      if (crossings == 0) continue;
      TileBin& bin = bin_of(start >> (3 * level));
      bin.segments.push_back(Segment::make(ray, start & within_tile, crossings));
      bin.crossings += static_cast<std::uint64_t>(crossings);
    }
    if (!rays.marks_end[ray]) continue;
    const std::uint64_t end = geometry.morton_of(walker.end_cell());
    bin_of(end >> (3 * level)).ends.push_back(static_cast<std::uint32_t>(end & within_tile));
  }
}

std::vector<TileWork> gather_tiles(const std::vector<TileBins>& workers) {
  std::vector<const TileBin*> all;
  for (const TileBins& worker : workers) {
    for (const TileBin& bin : worker.bins()) all.push_back(&bin);
  }
  std::stable_sort(all.begin(), all.end(), [](const TileBin* a, const TileBin* b) { return a->tile < b->tile; });
  std::vector<TileWork> tiles;
  for (const TileBin* bin : all) {
    if (tiles.empty() || tiles.back().tile != bin->tile) tiles.emplace_back().tile = bin->tile;
    tiles.back().bins.push_back(bin);
    tiles.back().crossings += bin->crossings;
  }
  return tiles;
}

}  // namespace rayvox
