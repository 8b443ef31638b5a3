#include "rayvox/octree/change_set.hpp"

namespace rayvox {
namespace {

// All known slots, or those that changed after `since`.
struct Collector {
  bool all;
  std::uint64_t since;
  std::vector<Region>& regions;

  void visit(const Child& slot, std::uint64_t slot_revision, int level, const Cell& first) {
    if (all ? slot.is_unknown() : slot_revision <= since) return;
    if (slot.kind() != Child::Kind::inner) {
      regions.push_back({&slot, level, first});
      return;
    }
    const InnerNode& node = *slot.inner();
    for (int i = 0; i < 8; ++i) visit(node.child[i], node.revision[i], level - 1, child_cell(first, level, i));
  }
};

}  // namespace

ChangedRegions changed_regions(const MapSnapshot& map, std::uint64_t since) {
  ChangedRegions changes;
  // A receiver ahead of the map has seen another life of it.
  changes.full = since < map.first_revision || since > map.revision;
  Collector{changes.full, since, changes.regions}.visit(map.root, map.root_revision, map.geometry.depth(),
                                                        root_cell(map.geometry));
  return changes;
}

}  // namespace rayvox
