#include "rayvox/ray_shooting/scan_insertion.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "rayvox/octree/tile_update.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/beam_insertion.hpp"
#include "rayvox/ray_shooting/embree_shooting.hpp"
#include "rayvox/ray_shooting/insertion_workspace.hpp"
#include "rayvox/ray_shooting/stopwatch.hpp"

namespace rayvox {
namespace {

constexpr std::size_t rays_per_chunk = 1024;
constexpr std::size_t segments_per_share = 4096;

// Measured on an AVX-512 machine (benchmarks/RESULTS.md): what the beam engine saves a voxel step, and what sorting
// rays and descending the octree cost a scan, however small.
constexpr double ns_saved_per_step = 0.7, ns_of_beams = 3.4e5;

void cut_rays_at_tiles(const ScanRays& rays, const MapGeometry& geometry, int workers, InsertionWorkspace& workspace) {
  const std::size_t chunks = (rays.count() + rays_per_chunk - 1) / rays_per_chunk;
  parallel_for(chunks, workers, [&](std::size_t chunk, int worker) {
    TileBins& own = workspace.bins[static_cast<std::size_t>(worker)];
    const std::size_t first = chunk * rays_per_chunk, last = std::min(first + rays_per_chunk, rays.count());
    own.add_rays(rays, first, last, geometry);
    own.add_ends(rays, first, last, geometry, geometry.tile_level());
  });
}

void shoot(std::uint64_t tile, std::span<const Segment> segments, const ScanRays& rays, const MapGeometry& geometry,
           const Kernels& kernels, TileMarks& marks) {
  const Cell low = geometry.cell_of_morton(tile << (3 * geometry.tile_level()));
  kernels.walk_segments({{rays.origin.x, rays.origin.y, rays.origin.z},
                         {rays.end[0].data(), rays.end[1].data(), rays.end[2].data()},
                         {low[0], low[1], low[2]},
                         segments.data(),
                         segments.size()},
                        marks);
}

// One tile by one worker.
void shoot_alone(const TileWork& tile, const ScanRays& rays, const MapGeometry& geometry, const Kernels& kernels,
                 TileMarks& marks) {
  for (const TileBin* bin : tile.bins) shoot(tile.tile, bin->segments, rays, geometry, kernels, marks);
}

// Moves the free marks of one grid into another.
void merge_marks(TileMarks& from, TileMarks& into) {
  for (std::size_t cell = 0; cell < tile_cells; ++cell) into.cell[cell] |= from.cell[cell];
  std::fill_n(from.cell, tile_cells, std::uint8_t{TileMarks::none});
}

// One tile by all workers, each into marks of its own, merged into the first's: for a tile that holds so much of the
// scan, as the sensor's own does, that the others would wait for it.
void shoot_together(const TileWork& tile, const ScanRays& rays, const MapGeometry& geometry, const Kernels& kernels,
                    int workers, InsertionWorkspace& workspace) {
  std::vector<std::span<const Segment>> shares;
  for (const TileBin* bin : tile.bins) {
    const std::span<const Segment> segments(bin->segments);
    for (std::size_t first = 0; first < segments.size(); first += segments_per_share) {
      shares.push_back(segments.subspan(first, std::min(segments_per_share, segments.size() - first)));
    }
  }
  parallel_for(shares.size(), workers, [&](std::size_t share, int worker) {
    shoot(tile.tile, shares[share], rays, geometry, kernels, *workspace.marks[static_cast<std::size_t>(worker)]);
  });
  for (std::size_t worker = 1; worker < static_cast<std::size_t>(workers); ++worker) {
    merge_marks(*workspace.marks[worker], *workspace.marks[0]);
  }
}

// The tile's bricks with their marks, end points marked last: within one scan occupied wins.
std::vector<MarkedBrick> take_marked_bricks(const TileWork& tile, const Kernels& kernels, TileMarks& marks) {
  for (const TileBin* bin : tile.bins) {
    for (const std::uint32_t end : bin->ends) marks.cell[end] = TileMarks::occupied;
  }
  std::vector<MarkedBrick> bricks;
  for (std::uint32_t brick = 0; brick < bricks_per_tile; ++brick) {
    BrickMarks taken;
    if (kernels.take_marks(marks.cell + std::size_t{brick} * cells_per_brick, taken.free, taken.occupied)) {
      bricks.push_back({brick, taken});
    }
  }
  return bricks;
}

// Largest first, so that the last tile to finish is a small one.
std::vector<std::size_t> by_descending_work(const std::vector<TileWork>& tiles) {
  std::vector<std::size_t> order(tiles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return tiles[a].crossings > tiles[b].crossings; });
  return order;
}

// How many of the largest tiles are worth all workers: those with over half of one worker's fair share.
std::size_t count_of_large(const std::vector<TileWork>& tiles, const std::vector<std::size_t>& order, int workers) {
  std::uint64_t all = 0;
  for (const TileWork& tile : tiles) all += tile.crossings;
  std::size_t large = 0;
  while (workers > 1 && large < order.size() &&
         tiles[order[large]].crossings * 2 * static_cast<std::uint64_t>(workers) > all) {
    ++large;
  }
  return large;
}

// Steps of the rays are worth the beams. (The Embree engine is left to who asks for it: where space is saturated it
// beats the DDA, and the beam engine comes as close or closer on every workload.)
Engine cheapest_engine(const ScanRays& rays) {
  double steps = 0;
  for (std::size_t i = 0; i < rays.count(); ++i) {
    for (int axis = 0; axis < 3; ++axis) steps += std::abs(rays.end[axis][i] - rays.origin[axis]);
    if (steps * ns_saved_per_step > ns_of_beams) return Engine::beam;
  }
  return Engine::dda;
}

// The DDA and Embree engines: rays are cut, at tile borders or to the nodes that a miss would change, and each tile is
// walked by all its parts of rays into a grid of marks.
ScanStatistics insert_by_walking(MapSnapshot& map, const ScanRays& rays, EmbreeRegions* regions,
                                 InsertionWorkspace& workspace, int workers) {
  const Kernels& set = kernels();
  Stopwatch stage;
  ScanStatistics statistics;
  statistics.engine = regions ? Engine::embree : Engine::dda;
  if (regions) {
    regions->follow(map, bounds_of(rays));
    statistics.bvh_node_count = regions->node_count();
    statistics.bvh_s = stage.lap();
    cut_rays_at_changeable_nodes(rays, map.geometry, *regions, set, workers, workspace.bins);
  } else {
    cut_rays_at_tiles(rays, map.geometry, workers, workspace);
  }
  const std::vector<TileWork> work = gather_tiles(workspace.bins);
  std::vector<std::uint64_t> codes;
  for (const TileWork& tile : work) codes.push_back(tile.tile);
  const std::vector<OpenTile> open = open_tiles(map, codes, map.geometry.tile_level());
  statistics.cut_s = stage.lap();

  std::vector<ScanStatistics> parts(work.size());
  const std::vector<std::size_t> order = by_descending_work(work);
  std::vector<std::vector<MarkedBrick>> large(count_of_large(work, order, workers));
  for (std::size_t index = 0; index < large.size(); ++index) {
    Stopwatch watch;
    shoot_together(work[order[index]], rays, map.geometry, set, workers, workspace);
    large[index] = take_marked_bricks(work[order[index]], set, *workspace.marks[0]);
    parts[order[index]].shoot_s = watch.lap() * workers;
  }
  parallel_for(work.size(), workers, [&](std::size_t index, int worker) {
    const std::size_t tile = order[index];
    TileMarks& marks = *workspace.marks[static_cast<std::size_t>(worker)];
    Stopwatch watch;
    std::vector<MarkedBrick> bricks;
    if (index < large.size()) {
      bricks = std::move(large[index]);
    } else {
      shoot_alone(work[tile], rays, map.geometry, set, marks);
      bricks = take_marked_bricks(work[tile], set, marks);
      parts[tile].shoot_s = watch.lap();
    }
    parts[tile].voxel_steps = work[tile].crossings;
    parts[tile].brick_count = bricks.size();
    parts[tile].voxels_changed = update_tile(open[tile], bricks, map, set);
    parts[tile].update_s = watch.lap();
  });
  close_tiles(map, codes, map.geometry.tile_level());

  add_up(parts, workers, statistics);
  return statistics;
}

}  // namespace

void add_up(const std::vector<ScanStatistics>& parts, int workers, ScanStatistics& statistics) {
  statistics.tile_count = parts.size();
  for (const ScanStatistics& part : parts) {
    statistics.voxel_steps += part.voxel_steps;
    statistics.brick_count += part.brick_count;
    statistics.voxels_changed += part.voxels_changed;
    statistics.shoot_s += part.shoot_s / workers;
    statistics.update_s += part.update_s / workers;
  }
}

ScanStatistics insert_rays(MapSnapshot& map, const ScanRays& rays, Engine engine,
                           std::unique_ptr<EmbreeRegions>& regions) {
  const int workers = thread_count();  // one value throughout, whoever changes it meanwhile
  Stopwatch total;
  const WorkspaceLease workspace(workers);
  if (engine == Engine::automatic) engine = cheapest_engine(rays);
  std::optional<ScanStatistics> statistics;
  if (engine == Engine::beam) statistics = insert_by_beams(map, rays, *workspace, workers);
  if (engine == Engine::embree && !regions) regions = std::make_unique<EmbreeRegions>();
  if (!statistics) {
    statistics = insert_by_walking(map, rays, engine == Engine::embree ? regions.get() : nullptr, *workspace, workers);
  }
  statistics->ray_count = rays.count();
  statistics->total_s = total.lap();
  return *statistics;
}

}  // namespace rayvox
