#include "rayvox/octree/tile_update.hpp"

#include <algorithm>

#include "rayvox/octree/edit.hpp"

namespace rayvox {
namespace {

// Calls visit(child index, sub-range) for each run of codes with the same three bits at `shift`.
template <class Code, class Item, class Visit>
void for_each_child(std::span<Item> items, int shift, const Code& code_of, const Visit& visit) {
  for (std::size_t first = 0; first < items.size();) {
    const int index = static_cast<int>(code_of(items[first]) >> shift & 7);
    std::size_t last = first + 1;
    while (last < items.size() && static_cast<int>(code_of(items[last]) >> shift & 7) == index) ++last;
    visit(index, items.subspan(first, last - first));
    first = last;
  }
}

std::uint64_t tile_code(std::uint64_t tile) { return tile; }
std::uint32_t brick_code(const MarkedBrick& brick) { return brick.brick; }

struct TileOpener {
  int tile_level;
  std::vector<OpenTile>& open;

  void visit(Child& slot, std::uint64_t& slot_revision, int level, std::span<const std::uint64_t> tiles) {
    if (level == tile_level) {
      open.push_back({tile_level, &slot, &slot_revision});
      return;
    }
    InnerNode& node = open_inner(slot, slot_revision);
    for_each_child(tiles, 3 * (level - 1 - tile_level), tile_code,
                   [&](int index, auto below) { visit(node.child[index], node.revision[index], level - 1, below); });
  }
};

struct TileCloser {
  int tile_level;

  void visit(Child& slot, std::uint64_t& slot_revision, int level, std::span<const std::uint64_t> tiles) {
    if (level == tile_level) return;
    InnerNode& node = *slot.inner();
    for_each_child(tiles, 3 * (level - 1 - tile_level), tile_code, [&](int index, auto below) {
      visit(node.child[index], node.revision[index], level - 1, below);
      slot_revision = std::max(slot_revision, node.revision[index]);
    });
    close_inner(slot);
  }
};

struct TileUpdater {
  const UpdateModel model;
  const Kernels& kernels;
  const std::uint64_t revision;

  std::uint64_t visit(Child& slot, std::uint64_t& slot_revision, int level, std::span<const MarkedBrick> bricks) {
    if (level == brick_level) {
      const int changed = update_brick(slot, bricks.front().marks, model, kernels);
      if (changed) slot_revision = revision;
      return static_cast<std::uint64_t>(changed);
    }
    if (slot.is_leaf() && saturated(slot.leaf_log_odds(), bricks)) return 0;
    const bool was_inner = slot.kind() == Child::Kind::inner;
    InnerNode& node = open_inner(slot, slot_revision);
    std::uint64_t changed = 0;
    for_each_child(bricks, 3 * (level - 1 - brick_level), brick_code, [&](int index, auto below) {
      changed += visit(node.child[index], node.revision[index], level - 1, below);
    });
    if (changed) slot_revision = revision;
    if (changed || !was_inner) close_inner(slot);
    return changed;
  }

  // Whether a leaf at this value ignores all the marks.
  bool saturated(float log_odds, std::span<const MarkedBrick> bricks) const {
    const auto none = [](const std::uint64_t (&masks)[8]) {
      return std::all_of(std::begin(masks), std::end(masks), [](std::uint64_t m) { return m == 0; });
    };
    if (log_odds > model.clamp_min) return false;
    return std::all_of(bricks.begin(), bricks.end(), [&](const MarkedBrick& b) { return none(b.marks.occupied); });
  }
};

}  // namespace

std::vector<OpenTile> open_tiles(MapSnapshot& map, std::span<const std::uint64_t> tiles, int tile_level) {
  std::vector<OpenTile> open;
  open.reserve(tiles.size());
  TileOpener{tile_level, open}.visit(map.root, map.root_revision, map.geometry.depth(), tiles);
  return open;
}

std::uint64_t update_tile(const OpenTile& tile, std::span<const MarkedBrick> bricks, const MapSnapshot& map,
                          const Kernels& kernels) {
  if (bricks.empty()) return 0;
  const SensorModel& m = map.model;
  const UpdateModel model{m.hit_log_odds, m.miss_log_odds, m.clamp_min_log_odds, m.clamp_max_log_odds};
  return TileUpdater{model, kernels, map.revision}.visit(*tile.slot, *tile.slot_revision, tile.level, bricks);
}

void close_tiles(MapSnapshot& map, std::span<const std::uint64_t> tiles, int tile_level) {
  TileCloser{tile_level}.visit(map.root, map.root_revision, map.geometry.depth(), tiles);
}

}  // namespace rayvox
