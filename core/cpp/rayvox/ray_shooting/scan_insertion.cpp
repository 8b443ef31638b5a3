#include "rayvox/ray_shooting/scan_insertion.hpp"

#include <algorithm>
#include <chrono>
#include <numeric>

#include "rayvox/octree/tile_update.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/insertion_workspace.hpp"

namespace rayvox {
namespace {

constexpr std::size_t rays_per_chunk = 1024;

class Stopwatch {
 public:
  /// Seconds since the last lap.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

void cut_rays_at_tiles(const ScanRays& rays, const MapGeometry& geometry, int workers, InsertionWorkspace& workspace) {
  const std::size_t chunks = (rays.count() + rays_per_chunk - 1) / rays_per_chunk;
  parallel_for(chunks, workers, [&](std::size_t chunk, int worker) {
    const std::size_t first = chunk * rays_per_chunk;
    workspace.bins[static_cast<std::size_t>(worker)].add(rays, first, std::min(first + rays_per_chunk, rays.count()),
                                                         geometry);
  });
}

void shoot_tile(const TileWork& tile, const ScanRays& rays, const MapGeometry& geometry, const Kernels& kernels,
                TileMarks& marks) {
  const Cell low = geometry.cell_of_morton(tile.tile << (3 * geometry.tile_level()));
  for (const TileBin* bin : tile.bins) {
    kernels.walk_segments({{rays.origin.x, rays.origin.y, rays.origin.z},
                           {rays.end[0].data(), rays.end[1].data(), rays.end[2].data()},
                           {low[0], low[1], low[2]},
                           bin->segments.data(),
                           bin->segments.size()},
                          marks);
  }
  // After all free cells: within one scan occupied wins.
  for (const TileBin* bin : tile.bins) {
    for (const std::uint32_t end : bin->ends) marks.cell[end] = TileMarks::occupied;
  }
}

std::vector<MarkedBrick> take_marked_bricks(TileMarks& marks, const Kernels& kernels) {
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

}  // namespace

ScanStatistics insert_rays(MapSnapshot& map, const ScanRays& rays) {
  const Kernels& set = kernels();
  const int workers = thread_count();  // one value throughout, whoever changes it meanwhile
  Stopwatch total, stage;
  ScanStatistics statistics;
  statistics.ray_count = rays.count();

  const WorkspaceLease workspace(workers);
  cut_rays_at_tiles(rays, map.geometry, workers, *workspace);
  const std::vector<TileWork> work = gather_tiles(workspace->bins);
  std::vector<std::uint64_t> codes;
  for (const TileWork& tile : work) codes.push_back(tile.tile);
  const std::vector<OpenTile> open = open_tiles(map, codes);
  statistics.cut_s = stage.lap();

  std::vector<ScanStatistics> parts(work.size());
  const std::vector<std::size_t> order = by_descending_work(work);
  parallel_for(work.size(), workers, [&](std::size_t index, int worker) {
    const std::size_t tile = order[index];
    TileMarks& marks = *workspace->marks[static_cast<std::size_t>(worker)];
    Stopwatch watch;
    shoot_tile(work[tile], rays, map.geometry, set, marks);
    const std::vector<MarkedBrick> bricks = take_marked_bricks(marks, set);
    parts[tile].brick_count = bricks.size();
    parts[tile].shoot_s = watch.lap();
    parts[tile].voxels_changed = update_tile(open[tile], bricks, map, set);
    parts[tile].update_s = watch.lap();
  });
  close_tiles(map, codes);

  for (std::size_t tile = 0; tile < work.size(); ++tile) {
    statistics.voxel_steps += work[tile].crossings;
    statistics.brick_count += parts[tile].brick_count;
    statistics.voxels_changed += parts[tile].voxels_changed;
    statistics.shoot_s += parts[tile].shoot_s / workers;
    statistics.update_s += parts[tile].update_s / workers;
  }
  statistics.tile_count = work.size();
  statistics.total_s = total.lap();
  return statistics;
}

}  // namespace rayvox
