#include "rayvox/ray_shooting/beam_tile.hpp"

#include <algorithm>

#include "rayvox/octree/box.hpp"
#include "rayvox/ray_shooting/changeable_blocks.hpp"

namespace rayvox {
namespace {

constexpr std::uint64_t all_cells = ~std::uint64_t{0};

// Measured on an AVX-512 machine (benchmarks/RESULTS.md): what one cell costs that has to be asked, and one ray that
// may pass a tile of 64 cells, to be clipped to it and walked through it. Twice or half as much changes little.
constexpr double ns_per_asked_cell = 20, ns_per_walked_ray = 90;

// Child of a slot; space that is uniform has no slots below it, and its own stands for theirs (null: unknown).
const Child* child_of(const Child* slot, int index) {
  return slot && slot->kind() == Child::Kind::inner ? &slot->inner()->child[index] : slot;
}

CellBlock block_at(const Cell& first, int level) { return {{first[0], first[1], first[2]}, level}; }

}  // namespace

bool BeamShooter::is_wanted(const Child* slot, const Cell& first, int level) const {
  return (!slot || is_changeable(*slot, map_.model.clamp_min_log_odds)) &&
         kernels_.beam_reaches(scan_, block_at(first, level));
}

std::optional<std::vector<std::uint64_t>> BeamShooter::tiles_to_shoot(int tile_level, std::size_t most) const {
  std::vector<std::uint64_t> tiles;
  list_tiles(&map_.root, root_cell(map_.geometry), map_.geometry.depth(), tile_level, most, tiles);
  if (tiles.size() > most) return std::nullopt;
  return tiles;
}

void BeamShooter::list_tiles(const Child* slot, const Cell& first, int level, int tile_level, std::size_t most,
                             std::vector<std::uint64_t>& tiles) const {
  if (tiles.size() > most || !is_wanted(slot, first, level)) return;
  if (level == tile_level) {
    tiles.push_back(map_.geometry.morton_of(first) >> (3 * level));
    return;
  }
  for (int i = 0; i < 8; ++i)
    list_tiles(child_of(slot, i), child_cell(first, level, i), level - 1, tile_level, most, tiles);
}

std::uint64_t BeamShooter::shoot_tile(std::uint64_t tile, const OpenTile& open, BeamScratch& scratch) const {
  const int level = open.level;
  const Cell first = map_.geometry.cell_of_morton(tile << (3 * level));
  const CellBlock block = block_at(first, level);
  const auto rays = static_cast<double>(kernels_.count_rays_towards(scan_, block));
  const auto most = static_cast<std::uint64_t>(rays * ns_per_walked_ray * block.size() / 64 / ns_per_asked_cell);
  scratch.bricks.clear();
  const std::uint64_t asked = collect(open.slot, first, level, 0, most, scratch.bricks);
  if (asked > most) return walk_rays(block, scratch);
  for (const BeamScratch::WantedBrick& brick : scratch.bricks) {
    kernels_.shoot_brick(scan_, brick.block.cell, brick.wanted, scratch.masks.free + std::size_t{brick.brick} * 8);
  }
  return asked;
}

// The bricks below the slot that rays reach, with the cells that a miss would change; returns how many cells. Stops
// once these are more than `most`.
std::uint64_t BeamShooter::collect(const Child* slot, const Cell& first, int level, std::uint32_t brick,
                                   std::uint64_t most, std::vector<BeamScratch::WantedBrick>& bricks) const {
  if (!is_wanted(slot, first, level)) return 0;
  std::uint64_t asked = 0;
  if (level > brick_level) {
    for (int i = 0; i < 8 && asked <= most; ++i) {
      const auto code = static_cast<std::uint32_t>(i) << (3 * (level - 1 - brick_level));
      asked += collect(child_of(slot, i), child_cell(first, level, i), level - 1, brick | code, most - asked, bricks);
    }
    return asked;
  }
  BeamScratch::WantedBrick& wanted = bricks.emplace_back();
  wanted.block = block_at(first, level);
  wanted.brick = brick;
  for (int octant = 0; octant < 8; ++octant) {
    wanted.wanted[octant] = changeable_cells(slot, octant);
    asked += static_cast<std::uint64_t>(__builtin_popcountll(wanted.wanted[octant]));
  }
  return asked;
}

std::uint64_t BeamShooter::changeable_cells(const Child* slot, int octant) const {
  if (!slot || slot->kind() != Child::Kind::brick) return all_cells;
  const Brick& brick = *slot->brick();
  const std::uint64_t unknown = ~brick.known[octant];
  const float clamp_min = map_.model.clamp_min_log_odds;
  if (unknown == all_cells || brick.octant_max[octant] <= clamp_min) return unknown;
  return brick.is_dense(octant) ? unknown | kernels_.cells_above(brick.cells(octant), clamp_min) : all_cells;
}

// The exact DDA, from where each ray enters the tile.
std::uint64_t BeamShooter::walk_rays(const CellBlock& tile, BeamScratch& scratch) const {
  scratch.segments.resize(ray_count_ + 16);
  const std::size_t rays = kernels_.find_rays_towards(scan_, tile, scratch.segments.data());
  const std::size_t count = kernels_.clip_to_block(scan_, tile, scratch.segments.data(), rays);
  kernels_.walk_segments({{scan_.origin[0], scan_.origin[1], scan_.origin[2]},
                          {scan_.end[0], scan_.end[1], scan_.end[2]},
                          {tile.cell[0], tile.cell[1], tile.cell[2]},
                          scratch.segments.data(),
                          count},
                         scratch.marks);
  std::uint64_t none_occupied[8];
  for (std::size_t brick = 0; brick < std::size_t{1} << (3 * (tile.level - brick_level)); ++brick) {
    kernels_.take_marks(scratch.marks.cell + brick * cells_per_brick, scratch.masks.free + brick * 8, none_occupied);
  }
  std::uint64_t walked = 0;
  for (std::size_t i = 0; i < count; ++i) walked += scratch.segments[i].start_and_crossings >> 18;
  return walked;
}

}  // namespace rayvox
