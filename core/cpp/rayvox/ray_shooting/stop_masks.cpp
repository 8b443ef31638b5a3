#include "rayvox/ray_shooting/stop_masks.hpp"

#include <cmath>
#include <limits>

#include "rayvox/simd/kernels.hpp"

namespace rayvox {
namespace {

constexpr std::uint64_t all_cells = ~std::uint64_t{0};

// Below a slot: no cell stops rays, each does, or some do.
enum class Stops : std::uint8_t { nowhere, everywhere, somewhere };

}  // namespace

struct StopMasks::Builder {
  const float threshold;
  const float just_below_threshold = std::nextafter(threshold, -std::numeric_limits<float>::infinity());
  const bool unknown_stops;
  const Kernels& kernels;
  std::vector<StopNode>& nodes;
  std::vector<std::uint64_t>& cells;

  Stops of(const Child& slot) const {
    switch (slot.kind()) {
      case Child::Kind::unknown: return unknown_stops ? Stops::everywhere : Stops::nowhere;
      case Child::Kind::leaf: return slot.leaf_log_odds() >= threshold ? Stops::everywhere : Stops::nowhere;
      default: break;
    }
    const Summary summary = summary_of(slot);
    return summary.max_log_odds >= threshold || (summary.any_unknown && unknown_stops) ? Stops::somewhere
                                                                                       : Stops::nowhere;
  }

  std::uint64_t stopping_cells(const Brick& brick, int octant) const {
    const std::uint64_t known = brick.known[octant], unknown = unknown_stops ? ~known : 0;
    if (brick.octant_max[octant] < threshold || known == 0) return unknown;
    if (!brick.is_dense(octant)) return unknown | known;
    return unknown | (known & kernels.cells_above(brick.cells(octant), just_below_threshold));
  }

  // Children that a node gathers before they are stored side by side.
  struct Gathered {
    StopNode node;
    StopNode nodes[64];
    std::uint64_t cells[64];
    int count = 0;

    void add(int index, Stops stops) {
      if (stops == Stops::everywhere) node.full |= std::uint64_t{1} << index;
    }
    void add_mixed(int index) {
      node.mixed |= std::uint64_t{1} << index;
      ++count;
    }
  };

  // The node for an inner slot of this level, even and at least 4.
  StopNode node_of(const Child& slot, int level) {
    Gathered gathered;
    for (int i = 0; i < 8; ++i) gather_half(slot.inner()->child[i], level - 1, 8 * i, gathered);
    return store(gathered, level);
  }

  // A child of the octree's, of odd level, is eight children here.
  void gather_half(const Child& slot, int level, int first, Gathered& gathered) {
    const Stops stops = of(slot);
    if (stops == Stops::nowhere) return;
    for (int i = 0; i < 8; ++i) {
      if (stops == Stops::everywhere) {
        gathered.add(first + i, stops);
      } else if (slot.kind() == Child::Kind::brick) {
        gather_cells(stopping_cells(*slot.brick(), i), first + i, gathered);
      } else {
        gather(slot.inner()->child[i], level - 1, first + i, gathered);
      }
    }
  }

  void gather_cells(std::uint64_t stopping, int index, Gathered& gathered) {
    if (stopping == all_cells) gathered.add(index, Stops::everywhere);
    if (stopping == 0 || stopping == all_cells) return;
    gathered.cells[gathered.count] = stopping;
    gathered.add_mixed(index);
  }

  void gather(const Child& slot, int level, int index, Gathered& gathered) {
    const Stops stops = of(slot);
    gathered.add(index, stops);
    if (stops != Stops::somewhere) return;
    gathered.nodes[gathered.count] = node_of(slot, level);
    gathered.add_mixed(index);
  }

  StopNode store(const Gathered& gathered, int level) {
    StopNode node = gathered.node;
    if (level == 4) {
      node.first_child = static_cast<std::uint32_t>(cells.size());
      cells.insert(cells.end(), gathered.cells, gathered.cells + gathered.count);
    } else {
      node.first_child = static_cast<std::uint32_t>(nodes.size());
      nodes.insert(nodes.end(), gathered.nodes, gathered.nodes + gathered.count);
    }
    return node;
  }

  // The node above the whole octree, whose own root has this level.
  StopNode root_of(const Child& root, int level) {
    const Stops stops = of(root);
    if (level % 2 == 0 && stops == Stops::somewhere) return node_of(root, level);
    // An octree of odd depth, or a uniform one: its root takes the place of the first eight children, or all.
    if (level % 2 == 0) return {stops == Stops::everywhere ? all_cells : 0, 0, 0};
    Gathered gathered;
    gather_half(root, level, 0, gathered);
    return store(gathered, level + 1);
  }
};

StopMasks::StopMasks(const MapSnapshot& map, bool unknown_stops)
    : root_level_((map.geometry.depth() + 1) / 2 * 2), half_extent_(map.geometry.half_extent()) {
  Builder builder{.threshold = map.model.occupied_log_odds,
                  .unknown_stops = unknown_stops,
                  .kernels = kernels(),
                  .nodes = nodes_,
                  .cells = cells_};
  root_ = builder.root_of(map.root, map.geometry.depth());
}

}  // namespace rayvox
