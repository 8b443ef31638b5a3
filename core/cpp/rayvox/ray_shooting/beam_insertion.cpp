#include "rayvox/ray_shooting/beam_insertion.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "rayvox/octree/tile_update.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/stopwatch.hpp"

namespace rayvox {
namespace {

constexpr std::size_t rays_per_chunk = 4096;
// With fewer tiles, finer ones are taken, so that the last to finish keeps no other worker waiting for long.
constexpr std::size_t fewest_tiles = 64;

// A tile that the scan may change, with the end points in it, if any.
struct BeamTile {
  std::uint64_t tile;
  const TileWork* hit = nullptr;
};

std::vector<TileWork> bin_ends(const ScanRays& rays, const MapGeometry& geometry, int tile_level, int workers,
                               InsertionWorkspace& workspace) {
  parallel_for((rays.count() + rays_per_chunk - 1) / rays_per_chunk, workers, [&](std::size_t chunk, int worker) {
    const std::size_t first = chunk * rays_per_chunk;
    workspace.bins[static_cast<std::size_t>(worker)].add_ends(
        rays, first, std::min(first + rays_per_chunk, rays.count()), geometry, tile_level);
  });
  return gather_tiles(workspace.bins);
}

// Tiles that rays reach or end in, ascending.
std::vector<BeamTile> unite(const std::vector<std::uint64_t>& reached, const std::vector<TileWork>& hit) {
  std::vector<BeamTile> tiles;
  auto next = reached.begin();
  for (const TileWork& work : hit) {
    for (; next != reached.end() && *next < work.tile; ++next) tiles.push_back({*next});
    if (next != reached.end() && *next == work.tile) ++next;
    tiles.push_back({work.tile, &work});
  }
  for (; next != reached.end(); ++next) tiles.push_back({*next});
  return tiles;
}

// Rays walked one by one would each enter one or two tiles per tile's edge of depth.
std::size_t most_tiles(double total_depth, int tile_level) {
  return static_cast<std::size_t>(64 + 2 * total_depth / (1 << tile_level));
}

// Nearest to the tile of the origin first: those have most rays, and the last tile to finish should be a small one.
std::vector<std::size_t> by_distance(const std::vector<std::uint64_t>& tiles, std::uint64_t origin_tile) {
  const auto along = [&](std::uint64_t tile, int axis) {
    return static_cast<std::int32_t>(gather_bits(tile >> axis)) -
           static_cast<std::int32_t>(gather_bits(origin_tile >> axis));
  };
  std::vector<std::pair<std::int32_t, std::size_t>> order;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    order.push_back({std::abs(along(tiles[i], 0)) + std::abs(along(tiles[i], 1)) + std::abs(along(tiles[i], 2)), i});
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> indices;
  for (const auto& [distance, index] : order) indices.push_back(index);
  return indices;
}

bool any_leaves_its_first_cell(const ScanRays& rays) {
  const Cell first = MapGeometry::cell_of(rays.origin);
  for (std::size_t i = 0; i < rays.count(); ++i) {
    if (MapGeometry::cell_of(rays[i].end) != first) return true;
  }
  return false;
}

void mark_ends(const BeamTile& tile, TileMasks& masks) {
  if (!tile.hit) return;
  for (const TileBin* bin : tile.hit->bins) {
    for (const std::uint32_t end : bin->ends) masks.occupied[end / 64] |= std::uint64_t{1} << end % 64;
  }
}

// The marked bricks, which leaves the masks empty. Within one scan occupied wins.
std::vector<MarkedBrick> take_bricks(TileMasks& masks, int tile_level) {
  std::vector<MarkedBrick> bricks;
  for (std::uint32_t brick = 0; brick < std::uint32_t{1} << (3 * (tile_level - brick_level)); ++brick) {
    std::uint64_t *free = masks.free + std::size_t{brick} * 8, *occupied = masks.occupied + std::size_t{brick} * 8;
    std::uint64_t any = 0;
    for (int octant = 0; octant < 8; ++octant) any |= free[octant] | occupied[octant];
    if (!any) continue;
    MarkedBrick& marked = bricks.emplace_back();
    marked.brick = brick;
    for (int octant = 0; octant < 8; ++octant) {
      marked.marks.occupied[octant] = occupied[octant];
      marked.marks.free[octant] = free[octant] & ~occupied[octant];
      free[octant] = occupied[octant] = 0;
    }
  }
  return bricks;
}

}  // namespace

std::optional<ScanStatistics> insert_by_beams(MapSnapshot& map, const ScanRays& rays, InsertionWorkspace& workspace,
                                              int workers) {
  const Kernels& set = kernels();
  Stopwatch stage;
  if (!workspace.directions.build(rays, workers, set)) return std::nullopt;
  const BeamShooter shooter(workspace.directions.scan(), rays.count(), map, set);
  int tile_level = map.geometry.tile_level();
  std::optional<std::vector<std::uint64_t>> reached =
      shooter.tiles_to_shoot(tile_level, most_tiles(workspace.directions.total_depth(), tile_level));
  if (reached && reached->size() < fewest_tiles && tile_level > brick_level + 1) {
    reached = shooter.tiles_to_shoot(--tile_level, 8 * fewest_tiles);
  }
  if (!reached) return std::nullopt;
  const std::vector<TileWork> hit = bin_ends(rays, map.geometry, tile_level, workers, workspace);
  const std::vector<BeamTile> tiles = unite(*reached, hit);
  std::vector<std::uint64_t> codes;
  for (const BeamTile& tile : tiles) codes.push_back(tile.tile);
  const std::vector<OpenTile> open = open_tiles(map, codes, tile_level);
  ScanStatistics statistics;
  statistics.engine = Engine::beam;
  statistics.cut_s = stage.lap();

  // The origin's own cell: rays that start on its border may have left it before the first test could see them in it.
  const std::uint64_t origin_code = map.geometry.morton_of(MapGeometry::cell_of(rays.origin));
  const int tile_bits = 3 * tile_level;
  const bool leaves_origin = any_leaves_its_first_cell(rays);

  std::vector<ScanStatistics> parts(tiles.size());
  const std::vector<std::size_t> order = by_distance(codes, origin_code >> tile_bits);
  parallel_for(tiles.size(), workers, [&](std::size_t position, int worker) {
    const std::size_t index = order[position];
    BeamScratch& scratch = *workspace.beams[static_cast<std::size_t>(worker)];
    ScanStatistics& part = parts[index];
    Stopwatch watch;
    mark_ends(tiles[index], scratch.masks);
    part.voxel_steps = shooter.shoot_tile(tiles[index].tile, open[index], scratch);
    if (leaves_origin && tiles[index].tile == origin_code >> tile_bits) {
      const std::uint64_t cell = origin_code & ((std::uint64_t{1} << tile_bits) - 1);
      scratch.masks.free[cell / 64] |= std::uint64_t{1} << cell % 64;
    }
    const std::vector<MarkedBrick> bricks = take_bricks(scratch.masks, tile_level);
    part.shoot_s = watch.lap();
    part.brick_count = bricks.size();
    part.voxels_changed = update_tile(open[index], bricks, map, set);
    part.update_s = watch.lap();
  });
  close_tiles(map, codes, tile_level);
  add_up(parts, workers, statistics);
  return statistics;
}

}  // namespace rayvox
