#include "rayvox/octree/leaves.hpp"

#include "rayvox/octree/node_cursor.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

template <class Visit>
void for_each_leaf(const NodeCursor& node, const Cell& first, const Visit& visit) {
  if (node.kind() == NodeCursor::Kind::unknown) return;
  if (node.kind() == NodeCursor::Kind::leaf) {
    visit(node, first);
    return;
  }
  for (int i = 0; i < 8; ++i) for_each_leaf(node.child(i), child_cell(first, node.level(), i), visit);
}

// Splits the tree into regions of this level or smaller, in traversal order, to share out.
void split_regions(const Child& slot, int level, const Cell& first, std::vector<Region>& regions) {
  if (slot.is_unknown()) return;
  if (slot.kind() != Child::Kind::inner || level <= max_tile_level) {
    regions.push_back({&slot, level, first});
    return;
  }
  for (int i = 0; i < 8; ++i) split_regions(slot.inner()->child[i], level - 1, child_cell(first, level, i), regions);
}

std::vector<Region> all_regions(const MapSnapshot& map) {
  std::vector<Region> regions;
  split_regions(map.root, map.geometry.depth(), root_cell(map.geometry), regions);
  return regions;
}

}  // namespace

LeafReadout::LeafReadout(const MapSnapshot& map) : LeafReadout(map, all_regions(map)) {}

LeafReadout::LeafReadout(const MapSnapshot& map, std::vector<Region> regions)
    : map_(map), regions_(std::move(regions)), first_(regions_.size() + 1, 0) {
  count_leaves();
}

void LeafReadout::count_leaves() {
  parallel_for(regions_.size(), [&](std::size_t i, int) {
    std::size_t count = 0;
    for_each_leaf(NodeCursor(*regions_[i].slot, regions_[i].level), regions_[i].first,
                  [&](const NodeCursor&, const Cell&) { ++count; });
    first_[i + 1] = count;
  });
  for (std::size_t i = 0; i < regions_.size(); ++i) first_[i + 1] += first_[i];
}

void LeafReadout::write(const LeafArrays& out) const {
  parallel_for(regions_.size(), [&](std::size_t i, int) {
    std::size_t at = first_[i];
    for_each_leaf(NodeCursor(*regions_[i].slot, regions_[i].level), regions_[i].first,
                  [&](const NodeCursor& leaf, const Cell& first) {
                    for (int axis = 0; axis < 3; ++axis)
                      out.keys[3 * at + static_cast<std::size_t>(axis)] = first[axis];
                    out.depth[at] = static_cast<std::uint8_t>(map_.geometry.depth() - leaf.level());
                    out.log_odds[at] = leaf.log_odds();
                    ++at;
                  });
  });
}

namespace {

void collect_in_box(const NodeCursor& node, const Cell& first, const CellBox& box, int depth, LeafList& out) {
  if (node.kind() == NodeCursor::Kind::unknown || !box.overlaps(first, node.level())) return;
  if (node.kind() == NodeCursor::Kind::leaf) {
    out.keys.insert(out.keys.end(), first.begin(), first.end());
    out.depth.push_back(static_cast<std::uint8_t>(depth - node.level()));
    out.log_odds.push_back(node.log_odds());
    return;
  }
  for (int i = 0; i < 8; ++i) collect_in_box(node.child(i), child_cell(first, node.level(), i), box, depth, out);
}

}  // namespace

LeafList leaves_in_box(const MapSnapshot& map, const CellBox& box) {
  LeafList leaves;
  if (!box.empty()) {
    const int depth = map.geometry.depth();
    collect_in_box(NodeCursor(map.root, depth), root_cell(map.geometry), box, depth, leaves);
  }
  return leaves;
}

}  // namespace rayvox
