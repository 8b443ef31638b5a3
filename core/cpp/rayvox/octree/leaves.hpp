#pragma once
// Leaves read out as arrays.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "rayvox/octree/box.hpp"
#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// Where leaves are written, `capacity` of them: keys (3 int64 each: lowest finest-level cell), depth (0 = root),
/// log-odds.
struct LeafArrays {
  std::int64_t* keys;
  std::uint8_t* depth;
  float* log_odds;
};

/// A slot of the octree: its node spans 2^level cells from `first` on.
struct Region {
  const Child* slot;
  int level;
  Cell first;
};

/// The leaves of some regions of a snapshot, counted first so that the arrays can be made to measure. Leaves come
/// region by region in traversal (Morton) order; both passes use all threads.
class LeafReadout {
 public:
  /// All leaves.
  explicit LeafReadout(const MapSnapshot& map);
  /// The leaves of these regions.
  LeafReadout(const MapSnapshot& map, std::vector<Region> regions);

  std::size_t count() const { return first_.back(); }
  void write(const LeafArrays& out) const;

 private:
  void count_leaves();

  const MapSnapshot& map_;
  std::vector<Region> regions_;
  std::vector<std::size_t> first_;  // index of each region's first leaf; one more at the end
};

/// Leaves that touch the box, whole.
struct LeafList {
  std::vector<std::int64_t> keys;
  std::vector<std::uint8_t> depth;
  std::vector<float> log_odds;
};
LeafList leaves_in_box(const MapSnapshot& map, const CellBox& box);

}  // namespace rayvox
