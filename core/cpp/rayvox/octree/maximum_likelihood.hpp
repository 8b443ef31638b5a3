#pragma once
#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// The map with every occupied cell at clamp_max and every free one at clamp_min, pruned: what OctoMap's writeBinary
/// writes (toMaxLikelihood, prune).
MapSnapshot maximum_likelihood(const MapSnapshot& map);

}  // namespace rayvox
