#pragma once
#include <cstdint>
#include <vector>

#include "rayvox/collision/kdop_bvh.hpp"

namespace rayvox {

/// The hierarchy's shape before any volume is computed: which triangles belong to which node.
struct BvhTree {
  struct Node {
    std::uint32_t first_triangle, triangle_count;    // consecutive in `triangle_order`
    std::uint32_t first_child = 0, child_count = 0;  // none: a leaf
  };
  std::vector<Node> nodes;  // breadth first; siblings consecutive
  std::vector<std::uint32_t> triangle_order;
  std::vector<std::uint32_t> level_begin;  // first node of each level, and the number of nodes
};

/// Top-down construction (SIMDop, Sec. IV-A), level by level, the nodes of a level in parallel.
BvhTree build_tree(const CollisionMesh& mesh, const BvhOptions& options);

}  // namespace rayvox
