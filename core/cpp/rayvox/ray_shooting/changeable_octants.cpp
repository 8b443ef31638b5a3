#include "rayvox/ray_shooting/changeable_octants.hpp"

#include <algorithm>
#include <bit>

#include "rayvox/octree/box.hpp"

namespace rayvox {
namespace {

constexpr int octant_level = 2;
constexpr std::uint64_t all_cells = ~std::uint64_t{0};

constexpr std::size_t octants_in(int level) { return std::size_t{1} << (3 * (level - octant_level)); }

}  // namespace

// Slices touched by a mask of cells in Morton order.
ChangeableOctants::Slices ChangeableOctants::slices_of(std::uint64_t cells) {
  // Cells whose coordinate along an axis has bit 0 (bit 1) set: Morton bits axis and axis + 3.
  constexpr std::uint64_t low_bit[3] = {0xaaaaaaaaaaaaaaaa, 0xcccccccccccccccc, 0xf0f0f0f0f0f0f0f0};
  constexpr std::uint64_t high_bit[3] = {0xff00ff00ff00ff00, 0xffff0000ffff0000, 0xffffffff00000000};
  Slices slices = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t odd = cells & low_bit[axis], even = cells & ~low_bit[axis];
    const unsigned touched = static_cast<unsigned>((even & ~high_bit[axis]) != 0) |
                             static_cast<unsigned>((odd & ~high_bit[axis]) != 0) << 1 |
                             static_cast<unsigned>((even & high_bit[axis]) != 0) << 2 |
                             static_cast<unsigned>((odd & high_bit[axis]) != 0) << 3;
    slices |= static_cast<Slices>(touched << (4 * axis));
  }
  return slices;
}

struct ChangeableOctants::Collector {
  ChangeableOctants& found;
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
        for (int i = 0; i < 8; ++i) {
          found.octants_[first + static_cast<std::size_t>(i)] = slices_of(changeable_cells(*slot.brick(), i));
        }
    }
  }
  void fill(int level, std::size_t first) const {
    std::fill_n(found.octants_ + first, octants_in(level), all_slices);
  }
  std::uint64_t changeable_cells(const Brick& brick, int octant) const {
    const std::uint64_t unknown = ~brick.known[octant];
    if (!unknown && brick.octant_max[octant] <= clamp_min) return 0;
    if (!brick.is_dense(octant)) return all_cells;
    return unknown | kernels.cells_above(brick.cells(octant), clamp_min);
  }
};

ChangeableOctants ChangeableOctants::of(const Child& slot, int tile_level, float clamp_min_log_odds,
                                        const Kernels& kernels) {
  ChangeableOctants found;
  Collector{found, clamp_min_log_odds, kernels}.visit(slot, tile_level, 0);
  return found;
}

bool ChangeableOctants::contains(const ChangeableOctants& other) const {
  unsigned lacking = 0;
  for (std::size_t i = 0; i < std::size(octants_); ++i) lacking |= other.octants_[i] & ~octants_[i];
  return lacking == 0;
}

int ChangeableOctants::count() const {
  return static_cast<int>(std::count_if(std::begin(octants_), std::end(octants_), [](Slices s) { return s != 0; }));
}

ChangeableOctants& ChangeableOctants::operator|=(const ChangeableOctants& other) {
  for (std::size_t i = 0; i < std::size(octants_); ++i) octants_[i] |= other.octants_[i];
  return *this;
}

struct ChangeableOctants::Splitter {
  const ChangeableOctants& octants;
  std::vector<ChangeableBox>& boxes;

  // Adds the node's boxes; true, with nothing added, if all of it is changeable.
  bool visit(const Cell& first, int level, std::size_t octant) {
    if (level == octant_level) return add_octant(first, octants.octants_[octant]);
    bool whole[8];
    const std::size_t before = boxes.size();
    for (std::size_t i = 0; i < 8; ++i) {
      whole[i] = visit(child_cell(first, level, static_cast<int>(i)), level - 1, octant + i * octants_in(level - 1));
    }
    if (boxes.size() == before && std::all_of(whole, whole + 8, [](bool w) { return w; })) return true;
    for (int i = 0; i < 8; ++i) {
      if (whole[i]) add_node(child_cell(first, level, i), level - 1);
    }
    return false;
  }
  bool add_octant(const Cell& first, Slices slices) {
    if (slices == all_slices) return true;
    if (slices == 0) return false;
    ChangeableBox box{first, {}, octant_level};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const unsigned along = slices >> (4 * axis) & 0xf;
      const int lowest = std::countr_zero(along), end = std::bit_width(along);
      box.low[axis] += lowest;
      box.size[axis] = end - lowest;
    }
    boxes.push_back(box);
    return false;
  }
  void add_node(const Cell& first, int level) {
    const std::int32_t size = std::int32_t{1} << level;
    boxes.push_back({first, {size, size, size}, level});
  }
};

std::vector<ChangeableBox> ChangeableOctants::boxes(const Cell& tile, int tile_level) const {
  std::vector<ChangeableBox> found;
  Splitter splitter{*this, found};
  if (splitter.visit(tile, tile_level, 0)) splitter.add_node(tile, tile_level);
  return found;
}

}  // namespace rayvox
