#pragma once
// The tree of StopMasks as plain data, shared with the kernels of every instruction set.
#include <cstdint>

namespace rayvox {

/// A node of 4x4x4 children, in Morton order: a bit of `full` says that a child stops rays throughout, one of `mixed`
/// that a node (or, below level 4, a word of cells) is kept for it; neither, that rays pass it.
struct StopNode {
  std::uint64_t full = 0, mixed = 0;
  std::uint32_t first_child = 0;  // of the mixed ones, which lie side by side
};

/// The tree as kernels see it. Level 2 are the words of `cells`, level 4 the nodes above them, and so on.
struct StopTree {
  static constexpr int max_levels = 22;

  const StopNode* nodes;
  const std::uint64_t* cells;
  StopNode root;
  std::int32_t root_level;  // even
  std::int32_t half_extent;
};

/// A ray on which the first stop is asked for (voxel units), and the answer.
struct StopQuery {
  enum Answer : std::int32_t { passes, stopped, undecided };
  double origin[3], end[3];
  double t;              // ray parameter at which `cell` is entered
  std::int32_t cell[3];  // where the ray is stopped
  Answer answer;
};

}  // namespace rayvox
