#pragma once
#include <array>
#include <bit>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/octree/node_cursor.hpp"

namespace rayvox {

/// Finds the leaf of one cell after another, going up only as far as the two cells' paths differ.
class LeafFinder {
 public:
  explicit LeafFinder(const MapSnapshot& map) : lowest_(map.geometry.depth()) {
    path_.fill(NodeCursor(map.root, lowest_));
  }

  /// The leaf or unknown node that holds the cell with this Morton code.
  const NodeCursor& find(std::uint64_t code) {
    const std::uint64_t difference = code ^ code_;
    code_ = code;
    // The lowest level at which both cells share a node.
    const int shared = difference ? (static_cast<int>(std::bit_width(difference)) + 2) / 3 : 0;
    if (shared > lowest_) lowest_ = shared;
    while (path_[static_cast<std::size_t>(lowest_)].kind() == NodeCursor::Kind::inner) {
      const NodeCursor& node = path_[static_cast<std::size_t>(lowest_)];
      --lowest_;
      path_[static_cast<std::size_t>(lowest_)] = node.child(static_cast<int>(code >> (3 * lowest_) & 7));
    }
    return path_[static_cast<std::size_t>(lowest_)];
  }

 private:
  int lowest_;  // path_[lowest_] is the last found; above it path_ holds its ancestors
  std::uint64_t code_ = 0;
  std::array<NodeCursor, max_depth + 1> path_;
};

}  // namespace rayvox
