#pragma once
// What stops rays in one snapshot, as bit masks: a tree of 4x4x4 children a node, 64 cells or nodes to a word. Such a
// tree of a building fits into a core's cache, which the octree with its log-odds does not; so a ray's way through it
// is a few steps of a few nanoseconds. Made in one pass over the octree, worth it from some thousand rays on.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/stop_tree.hpp"

namespace rayvox {

/// The masks of one snapshot, which they do not keep.
class StopMasks {
 public:
  /// Occupied cells stop rays, and unknown ones if so asked.
  StopMasks(const MapSnapshot& map, bool unknown_stops);

  StopTree tree() const { return {nodes_.data(), cells_.data(), root_, root_level_, half_extent_}; }
  std::size_t bytes() const { return nodes_.capacity() * sizeof(StopNode) + cells_.capacity() * sizeof(cells_[0]); }

 private:
  struct Builder;

  std::vector<StopNode> nodes_;
  std::vector<std::uint64_t> cells_;
  StopNode root_;
  std::int32_t root_level_, half_extent_;
};

}  // namespace rayvox
