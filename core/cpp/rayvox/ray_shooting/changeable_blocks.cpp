#include "rayvox/ray_shooting/changeable_blocks.hpp"

#include <algorithm>

#include "rayvox/octree/box.hpp"

namespace rayvox {
namespace {

// Blocks of a node: how many, and a bit for each from bit 0.
int block_count(int level) { return 1 << (3 * std::max(level - finest_changeable_level, 0)); }
std::uint64_t all_blocks(int level) { return ~std::uint64_t{0} >> (64 - block_count(level)); }

void split(std::uint64_t blocks, const Cell& first, int level, std::vector<ChangeableNode>& nodes) {
  if (blocks == 0) return;
  if (blocks == all_blocks(level)) {
    nodes.push_back({first, level});
    return;
  }
  const int below = block_count(level - 1);
  for (int i = 0; i < 8; ++i) {
    split(blocks >> (i * below) & all_blocks(level - 1), child_cell(first, level, i), level - 1, nodes);
  }
}

}  // namespace

bool is_changeable(const Child& slot, float clamp_min_log_odds) {
  const Summary summary = summary_of(slot);
  return summary.any_unknown || summary.max_log_odds > clamp_min_log_odds;
}

std::uint64_t changeable_blocks(const Child& slot, int tile_level, float clamp_min_log_odds) {
  if (!is_changeable(slot, clamp_min_log_odds)) return 0;
  if (slot.kind() != Child::Kind::inner || tile_level <= finest_changeable_level) return all_blocks(tile_level);
  std::uint64_t blocks = 0;
  for (int i = 0; i < 8; ++i) {
    blocks |= changeable_blocks(slot.inner()->child[i], tile_level - 1, clamp_min_log_odds)
              << (i * block_count(tile_level - 1));
  }
  return blocks;
}

std::vector<ChangeableNode> nodes_of_blocks(std::uint64_t blocks, const Cell& tile, int tile_level) {
  std::vector<ChangeableNode> nodes;
  split(blocks, tile, tile_level, nodes);
  return nodes;
}

}  // namespace rayvox
