#include "rayvox/octree/node_cursor.hpp"

#include <algorithm>

#include "rayvox/octree/map_geometry.hpp"

namespace rayvox {
namespace {

// A 2x2x2 group of a dense octant: its known bits and eight log-odds.
struct Group {
  std::uint8_t known;
  const float* log_odds;

  Group(const Brick& brick, int first_cell)
      : known(static_cast<std::uint8_t>(brick.known[first_cell / cells_per_octant] >> (first_cell % cells_per_octant))),
        log_odds(brick.cells(first_cell / cells_per_octant) + first_cell % cells_per_octant) {}
  bool uniform() const {
    return known == 0xff && std::all_of(log_odds + 1, log_odds + 8, [&](float v) { return v == log_odds[0]; });
  }
  float max() const {
    float value = -std::numeric_limits<float>::infinity();
    for (int i = 0; i < 8; ++i) {
      if (known >> i & 1) value = std::max(value, log_odds[i]);
    }
    return value;
  }
};

}  // namespace

NodeCursor::NodeCursor(const Brick* brick, int level, int first_cell)
    : brick_(brick), level_(level), first_cell_(first_cell) {
  const int octant = first_cell / cells_per_octant;
  if (!brick->is_dense(octant)) {
    kind_ = brick->is_unknown(octant) ? Kind::unknown : Kind::leaf;
  } else if (level == 2) {
    kind_ = Kind::inner;
  } else if (level == 1) {
    const Group group(*brick, first_cell);
    kind_ = group.known == 0 ? Kind::unknown : group.uniform() ? Kind::leaf : Kind::inner;
  } else {
    kind_ = brick->known[octant] >> (first_cell % cells_per_octant) & 1 ? Kind::leaf : Kind::unknown;
  }
}

NodeCursor NodeCursor::child(int index) const {
  if (brick_) return NodeCursor(brick_, level_ - 1, first_cell_ + (index << (3 * (level_ - 1))));
  return NodeCursor(slot_->inner()->child[index], level_ - 1);
}

float NodeCursor::log_odds() const {
  if (!brick_) return slot_->is_leaf() ? slot_->leaf_log_odds() : slot_->inner()->summary.max_log_odds;
  const int octant = first_cell_ / cells_per_octant;
  if (level_ == brick_level) return brick_->max_log_odds();
  if (level_ == 2 || !brick_->is_dense(octant)) return brick_->octant_max[octant];
  if (level_ == 1) return Group(*brick_, first_cell_).max();
  return brick_->cells(octant)[first_cell_ % cells_per_octant];
}

bool NodeCursor::any_unknown() const {
  if (!brick_) return slot_->inner()->summary.any_unknown;
  if (level_ == brick_level) return brick_->any_unknown();
  const std::uint64_t known = brick_->known[first_cell_ / cells_per_octant];
  if (level_ == 2) return ~known != 0;
  return (~known >> (first_cell_ % cells_per_octant) & 0xff) != 0;
}

unsigned NodeCursor::children_at_least(float log_odds) const {
  unsigned children = 0;
  if (!brick_) {
    for (int i = 0; i < 8; ++i) {
      const NodeCursor below = child(i);
      children |= static_cast<unsigned>(below.kind() != Kind::unknown && below.log_odds() >= log_odds) << i;
    }
    return children;
  }
  if (level_ == brick_level) {
    for (int i = 0; i < 8; ++i) {
      children |= static_cast<unsigned>(!brick_->is_unknown(i) && brick_->octant_max[i] >= log_odds) << i;
    }
    return children;
  }
  const int octant = first_cell_ / cells_per_octant, first = first_cell_ % cells_per_octant;
  const float* cells = brick_->cells(octant) + first;
  const std::uint64_t known = brick_->known[octant] >> first;
  const int per_child = level_ == 2 ? 8 : 1;
  for (int i = 0; i < 8; ++i) {
    unsigned found = 0;
    for (int cell = i * per_child; cell < (i + 1) * per_child; ++cell) {
      found |= static_cast<unsigned>(cells[cell] >= log_odds) & static_cast<unsigned>(known >> cell & 1);
    }
    children |= found << i;
  }
  return children;
}

unsigned NodeCursor::children_with_unknown() const {
  unsigned children = 0;
  for (int i = 0; i < 8; ++i) {
    const NodeCursor below = child(i);
    const bool unknown = below.kind() == Kind::unknown || (below.kind() == Kind::inner && below.any_unknown());
    children |= static_cast<unsigned>(unknown) << i;
  }
  return children;
}

}  // namespace rayvox
