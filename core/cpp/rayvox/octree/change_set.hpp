#pragma once
#include <cstdint>
#include <vector>

#include "rayvox/octree/leaves.hpp"

namespace rayvox {

/// What changed after revision `since`: regions (bricks, or larger nodes that became uniform or unknown) whose former
/// content is void, to be replaced by the leaves they hold now. `full`: everything the receiver holds is void, because
/// the map does not know its changes that far back.
struct ChangedRegions {
  bool full = false;
  std::vector<Region> regions;
};

ChangedRegions changed_regions(const MapSnapshot& map, std::uint64_t since);

}  // namespace rayvox
