#include "rayvox/octree/map_statistics.hpp"

#include <limits>

#include "rayvox/octree/node_cursor.hpp"

namespace rayvox {
namespace {

void count(const NodeCursor& node, const Cell& first, const SensorModel& model, MapStatistics& total) {
  if (node.kind() == NodeCursor::Kind::unknown) return;
  ++total.nodes;
  if (node.kind() == NodeCursor::Kind::inner) {
    for (int i = 0; i < 8; ++i) count(node.child(i), child_cell(first, node.level(), i), model, total);
    return;
  }
  const std::uint64_t cells = std::uint64_t{1} << (3 * node.level());
  const bool occupied = model.is_occupied(node.log_odds());
  ++(occupied ? total.occupied_leaves : total.free_leaves);
  (occupied ? total.occupied_cells : total.free_cells) += cells;
  const std::int32_t size = std::int32_t{1} << node.level();
  for (int i = 0; i < 3; ++i) {
    total.known.low[i] = std::min(total.known.low[i], first[i]);
    total.known.high[i] = std::max(total.known.high[i], first[i] + (size - 1));
  }
}

std::size_t bytes_below(const Child& slot) {
  // The allocator adds a header of its own to each block.
  constexpr std::size_t block_header = 16;
  if (slot.kind() == Child::Kind::brick) return Brick::bytes(slot.brick()->dense_mask) + block_header;
  if (slot.kind() != Child::Kind::inner) return 0;
  std::size_t total = sizeof(InnerNode) + block_header;
  for (const Child& child : slot.inner()->child) total += bytes_below(child);
  return total;
}

}  // namespace

MapStatistics statistics_of(const MapSnapshot& map) {
  constexpr std::int32_t most = std::numeric_limits<std::int32_t>::max();
  MapStatistics total;
  total.known = {{most, most, most}, {-most, -most, -most}};
  count(NodeCursor(map.root, map.geometry.depth()), root_cell(map.geometry), map.model, total);
  return total;
}

std::size_t memory_bytes(const MapSnapshot& map) { return bytes_below(map.root); }

}  // namespace rayvox
