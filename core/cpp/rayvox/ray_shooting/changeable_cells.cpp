#include "rayvox/ray_shooting/changeable_cells.hpp"

#include <algorithm>
#include <bit>

#include "rayvox/octree/box.hpp"

namespace rayvox {
namespace {

constexpr std::uint64_t all_cells = ~std::uint64_t{0};

constexpr std::size_t octants_in(int level) { return std::size_t{1} << (3 * (level - octant_level)); }

}  // namespace

OctantBox box_around(std::uint64_t cells) {
  // Cells whose coordinate along an axis has bit 0 (bit 1) set: Morton bits axis and axis + 3.
  constexpr std::uint64_t odd_slices[3] = {0xaaaaaaaaaaaaaaaa, 0xcccccccccccccccc, 0xf0f0f0f0f0f0f0f0};
  constexpr std::uint64_t upper_half[3] = {0xff00ff00ff00ff00, 0xffff0000ffff0000, 0xffffffff00000000};
  OctantBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint64_t odd = cells & odd_slices[axis], even = cells & ~odd_slices[axis];
    const unsigned slices = static_cast<unsigned>((even & ~upper_half[axis]) != 0) |
                            static_cast<unsigned>((odd & ~upper_half[axis]) != 0) << 1 |
                            static_cast<unsigned>((even & upper_half[axis]) != 0) << 2 |
                            static_cast<unsigned>((odd & upper_half[axis]) != 0) << 3;
    box.low[axis] = std::countr_zero(slices);
    box.size[axis] = std::bit_width(slices) - box.low[axis];
  }
  return box;
}

struct ChangeableCells::Collector {
  ChangeableCells& found;
  const float clamp_min;
  const Kernels& kernels;

  void visit(const Child& slot, int level, std::size_t first) {
    switch (slot.kind()) {
      case Child::Kind::unknown: fill(level, first); break;
      case Child::Kind::leaf:
        if (slot.leaf_log_odds() > clamp_min) fill(level, first);
        break;
      case Child::Kind::inner: {
        const InnerNode& node = *slot.inner();
        if (!node.summary.any_unknown && node.summary.max_log_odds <= clamp_min) break;
        for (std::size_t i = 0; i < 8; ++i) visit(node.child[i], level - 1, first + i * octants_in(level - 1));
        break;
      }
      case Child::Kind::brick:
        for (int i = 0; i < 8; ++i) found.octants_[first + static_cast<std::size_t>(i)] = in_octant(*slot.brick(), i);
    }
  }
  void fill(int level, std::size_t first) const { std::fill_n(found.octants_ + first, octants_in(level), all_cells); }
  std::uint64_t in_octant(const Brick& brick, int octant) const {
    const std::uint64_t unknown = ~brick.known[octant];
    if (!unknown && brick.octant_max[octant] <= clamp_min) return 0;
    if (!brick.is_dense(octant)) return all_cells;
    return unknown | kernels.cells_above(brick.cells(octant), clamp_min);
  }
};

ChangeableCells ChangeableCells::of(const Child& slot, int tile_level, float clamp_min_log_odds,
                                    const Kernels& kernels) {
  ChangeableCells found;
  Collector{found, clamp_min_log_odds, kernels}.visit(slot, tile_level, 0);
  return found;
}

bool ChangeableCells::contains(const ChangeableCells& other) const {
  std::uint64_t lacking = 0;
  for (std::size_t i = 0; i < std::size(octants_); ++i) lacking |= other.octants_[i] & ~octants_[i];
  return lacking == 0;
}

int ChangeableCells::octant_count() const {
  return static_cast<int>(std::count_if(std::begin(octants_), std::end(octants_), [](auto cells) { return cells != 0; }));
}

ChangeableCells& ChangeableCells::operator|=(const ChangeableCells& other) {
  for (std::size_t i = 0; i < std::size(octants_); ++i) octants_[i] |= other.octants_[i];
  return *this;
}

struct ChangeableCells::Splitter {
  const ChangeableCells& cells;
  std::vector<ChangeableNode>& nodes;

  // Adds the nodes below; true, with nothing added, if the node is changeable throughout.
  bool visit(const Cell& first, int level, std::size_t octant) {
    if (level == octant_level) {
      const std::uint64_t changeable = cells.octants_[octant];
      if (changeable && ~changeable) nodes.push_back({first, level, changeable});
      return changeable == all_cells;
    }
    bool whole[8];
    for (std::size_t i = 0; i < 8; ++i) {
      whole[i] = visit(child_cell(first, level, static_cast<int>(i)), level - 1, octant + i * octants_in(level - 1));
    }
    if (std::all_of(whole, whole + 8, [](bool w) { return w; })) return true;
    for (int i = 0; i < 8; ++i) {
      if (whole[i]) nodes.push_back({child_cell(first, level, i), level - 1, all_cells});
    }
    return false;
  }
};

std::vector<ChangeableNode> ChangeableCells::nodes(const Cell& tile, int tile_level) const {
  std::vector<ChangeableNode> found;
  if (Splitter{*this, found}.visit(tile, tile_level, 0)) found.push_back({tile, tile_level, all_cells});
  return found;
}

}  // namespace rayvox
