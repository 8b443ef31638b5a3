#include "rayvox/ray_shooting/tile_bins.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "rayvox/octree/morton.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"

namespace rayvox {

namespace {

constexpr auto spread_within_tile = [] {
  std::array<std::uint32_t, std::size_t{1} << max_tile_level> spread{};
  for (std::uint32_t i = 0; i < spread.size(); ++i) spread[i] = static_cast<std::uint32_t>(spread_bits(i));
  return spread;
}();

}  // namespace

// Where cells lie among tiles and in their tile, without the cost of whole Morton codes.
class TileAddresses {
 public:
  TileAddresses(const MapGeometry& geometry, int tile_level) : geometry_(geometry), level_(tile_level) {}

  /// Unique for the cell's tile, cheap, in no useful order.
  std::uint64_t name(const Cell& cell) const {
    return coordinate(cell, 0) >> level_ | coordinate(cell, 1) >> level_ << 21 | coordinate(cell, 2) >> level_ << 42;
  }
  std::uint32_t place_in_tile(const Cell& cell, std::size_t axis) const {
    return static_cast<std::uint32_t>(coordinate(cell, axis) & ((std::uint64_t{1} << level_) - 1));
  }
  std::uint32_t within_tile(const Cell& cell) const {
    return spread_within_tile[place_in_tile(cell, 0)] | spread_within_tile[place_in_tile(cell, 1)] << 1 |
           spread_within_tile[place_in_tile(cell, 2)] << 2;
  }

 private:
  std::uint64_t coordinate(const Cell& cell, std::size_t axis) const {
    return static_cast<std::uint64_t>(cell[axis] + geometry_.half_extent());
  }
  const MapGeometry& geometry_;
  const int level_;
};

void TileBins::clear() {
  for (TileBin& bin : bins_) {
    bin.segments.clear();
    bin.ends.clear();
    bin.crossings = 0;
    spare_.push_back(std::move(bin));
  }
  bins_.clear();
  index_.clear();
  std::fill(std::begin(recent_), std::end(recent_), Recent{});
}

TileBin& TileBins::bin_of(std::uint64_t name) {
  Recent& recent = recent_[(name ^ name >> 18 ^ name >> 36) & 255];
  if (recent.tile != name) {
    const auto [entry, added] = index_.try_emplace(name, static_cast<std::uint32_t>(bins_.size()));
    if (added) add_bin(name);
    recent = {name, entry->second};
  }
  return bins_[recent.index];
}

void TileBins::add_bin(std::uint64_t name) {
  if (spare_.empty()) {
    bins_.emplace_back();
  } else {
    bins_.push_back(std::move(spare_.back()));
    spare_.pop_back();
  }
  const auto coordinate = [name](int axis) { return static_cast<std::uint32_t>(name >> (21 * axis) & 0x1fffff); };
  bins_.back().tile = morton_encode(coordinate(0), coordinate(1), coordinate(2));
}

void TileBins::add_rays(const ScanRays& rays, std::size_t first, std::size_t last, const MapGeometry& geometry) {
  const TileAddresses addresses(geometry, geometry.tile_level());
  for (std::size_t ray = first; ray < last; ++ray) {
    RayWalker walker(rays[ray]);
    for (bool last_tile = false; !last_tile;) {
      const Cell before = walker.cell();
      last_tile = walker.end_in_block(geometry.tile_level());
      if (!last_tile) walker.leave_block(geometry.tile_level());
      const Cell& after = last_tile ? walker.end_cell() : walker.cell();
      const int crossings =
          std::abs(after[0] - before[0]) + std::abs(after[1] - before[1]) + std::abs(after[2] - before[2]);
      if (crossings == 0) continue;
      TileBin& bin = bin_of(addresses.name(before));
      bin.segments.push_back(Segment::make(ray, addresses.within_tile(before), crossings));
      bin.crossings += static_cast<std::uint64_t>(crossings);
    }
  }
}

void TileBins::add_ends(const ScanRays& rays, std::size_t first, std::size_t last, const MapGeometry& geometry,
                        int tile_level) {
  constexpr std::size_t most = 512;
  std::uint64_t tile[most];
  std::uint32_t place[most];
  for (; first < last; first += most) {
    const std::size_t found =
        kernels().find_end_cells({{rays.end[0].data() + first, rays.end[1].data() + first, rays.end[2].data() + first},
                                  rays.marks_end.data() + first,
                                  std::min(most, last - first),
                                  geometry.half_extent(),
                                  tile_level,
                                  tile,
                                  place});
    for (std::size_t i = 0; i < found; ++i) bin_of(tile[i]).ends.push_back(place[i]);
  }
}

void TileBins::add_segment(std::size_t ray, const Cell& from, int crossings, const MapGeometry& geometry) {
  const TileAddresses addresses(geometry, geometry.tile_level());
  TileBin& bin = bin_of(addresses.name(from));
  bin.segments.push_back(Segment::make(ray, addresses.within_tile(from), crossings));
  bin.crossings += static_cast<std::uint64_t>(crossings);
}

void TileBins::add_segments(const std::uint32_t* ray_of_lane, const PassedBox& passed, const Cell& box,
                            const MapGeometry& geometry) {
  if (!passed.lanes) return;
  const TileAddresses addresses(geometry, geometry.tile_level());
  TileBin& bin = bin_of(addresses.name(box));
  const std::uint32_t first[3] = {addresses.place_in_tile(box, 0), addresses.place_in_tile(box, 1),
                                  addresses.place_in_tile(box, 2)};
  for (std::uint32_t lanes = passed.lanes; lanes; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    const auto crossings = static_cast<int>(passed.crossings[lane]);
    if (crossings == 0) continue;
    const auto place = [&](int axis) { return first[axis] + static_cast<std::uint32_t>(passed.entry[axis][lane]); };
    const std::uint32_t entry =
        spread_within_tile[place(0)] | spread_within_tile[place(1)] << 1 | spread_within_tile[place(2)] << 2;
    bin.segments.push_back(Segment::make(ray_of_lane[lane], entry, crossings));
    bin.crossings += static_cast<std::uint64_t>(crossings);
  }
}

std::size_t TileBins::bytes() const {
  std::size_t total = 0;
  for (const std::vector<TileBin>* bins : {&bins_, &spare_}) {
    for (const TileBin& bin : *bins) {
      total += bin.segments.capacity() * sizeof(Segment) + bin.ends.capacity() * sizeof(std::uint32_t);
    }
  }
  return total;
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
