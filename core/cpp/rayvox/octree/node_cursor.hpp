#pragma once
#include <cstdint>

#include "rayvox/octree/inner_node.hpp"

namespace rayvox {

/// Reads the octree as one tree down to its finest cells, whether a level is stored as nodes or lies inside a brick,
/// pruned exactly as OctoMap prunes: eight known children with equal log-odds are one leaf.
class NodeCursor {
 public:
  enum class Kind : std::uint8_t { unknown, leaf, inner };

  NodeCursor() = default;
  NodeCursor(const Child& slot, int level) : slot_(&slot), level_(level) {
    switch (slot.kind()) {
      case Child::Kind::unknown: kind_ = Kind::unknown; break;
      case Child::Kind::leaf: kind_ = Kind::leaf; break;
      default: kind_ = Kind::inner;
    }
    if (slot.kind() == Child::Kind::brick) brick_ = slot.brick();
  }

  Kind kind() const { return kind_; }
  int level() const { return level_; }
  /// Log-odds of a leaf; of an inner node the maximum over its known cells, as OctoMap's.
  float log_odds() const;
  /// Whether anything below an inner node is unknown.
  bool any_unknown() const;
  /// The children of an inner node (bit i: child i) in which a known cell has at least these log-odds.
  unsigned children_at_least(float log_odds) const;
  /// Those in which something is unknown.
  unsigned children_with_unknown() const;
  /// Child 0 to 7 (x + 2y + 4z) of an inner node.
  NodeCursor child(int index) const;
  /// The slot, while the cursor is at or above brick level.
  const Child& slot() const { return *slot_; }
  /// Below: the brick and the Morton code of the node's first cell in it.
  const Brick* brick() const { return brick_; }
  int first_cell() const { return first_cell_; }

 private:
  NodeCursor(const Brick* brick, int level, int first_cell);

  const Child* slot_ = nullptr;
  const Brick* brick_ = nullptr;
  int level_ = 0;
  int first_cell_ = 0;
  Kind kind_ = Kind::unknown;
};

}  // namespace rayvox
