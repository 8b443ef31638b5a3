#pragma once
// Which parts of the octree can a ray still change? (DESIGN: model only what a scene requires.) A miss changes a cell
// unless it is known and at the lower clamping bound, so space of which that is true for all cells needs no ray.
#include <cstdint>
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// A node of the octree that rays may have to pass: 2^level cells from `first` on.
struct ChangeableNode {
  Cell first;
  std::int32_t level;

  bool operator==(const ChangeableNode&) const = default;
};

/// A bit per octant (4x4x4 cells) of one tile, in Morton order.
class OctantSet {
 public:
  /// The octants below a tile's slot that hold a cell which a miss would change.
  static OctantSet changeable(const Child& slot, int tile_level, float clamp_min_log_odds);

  bool contains(const OctantSet& other) const;
  int count() const;
  OctantSet& operator|=(const OctantSet& other);
  /// Adds the rest of every node of that level that has any octant in the set.
  void fill_nodes(int level, int tile_level);
  /// The largest nodes whose octants are all in the set.
  std::vector<ChangeableNode> nodes(const Cell& tile, int tile_level) const;

 private:
  void set(int level, int first_octant);
  void collect(const Child& slot, int level, int first_octant, float clamp_min_log_odds);
  int count(int level, int first_octant) const;
  void split(const Cell& first, int level, int first_octant, std::vector<ChangeableNode>& nodes) const;

  std::uint64_t words_[64] = {};
};

}  // namespace rayvox
