#include "rayvox/octree/clear_box.hpp"

#include "rayvox/octree/edit.hpp"

namespace rayvox {
namespace {

struct Clearing {
  const CellBox& box;
  std::uint64_t revision;

  void visit(Child& slot, std::uint64_t& slot_revision, int level, const Cell& first) const {
    if (slot.is_unknown() || !box.overlaps(first, level)) return;
    if (box.contains(first, level)) {
      slot = Child();
    } else if (level == brick_level) {
      clear_in_brick(slot, first);
    } else {
      InnerNode& node = open_inner(slot, slot_revision);
      for (int i = 0; i < 8; ++i) visit(node.child[i], node.revision[i], level - 1, child_cell(first, level, i));
      close_inner(slot);
    }
    slot_revision = revision;
  }

  void clear_in_brick(Child& slot, const Cell& first) const {
    OpenBrick open = OpenBrick::of(slot);
    for (std::uint32_t code = 0; code < cells_per_brick; ++code) {
      const Cell cell{first[0] + static_cast<std::int32_t>(morton_x(code)),
                      first[1] + static_cast<std::int32_t>(morton_y(code)),
                      first[2] + static_cast<std::int32_t>(morton_z(code))};
      if (box.contains(cell, 0)) open.known[code / 64] &= ~(std::uint64_t{1} << (code % 64));
    }
    slot = open.close();
  }
};

}  // namespace

void clear_cells(MapSnapshot& map, const CellBox& box) {
  if (box.empty()) return;
  Clearing{box, map.revision}.visit(map.root, map.root_revision, map.geometry.depth(), root_cell(map.geometry));
}

}  // namespace rayvox
