#pragma once
// Questions to a snapshot about many points or boxes, on all cores.
#include <cstdint>

#include "rayvox/geometry/points_view.hpp"
#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

enum class OccupancyState : std::uint8_t { unknown = 0, free = 1, occupied = 2 };

/// Writes, per point (metres), the log-odds of the node at `level` that holds it, or of the leaf above; an inner node's
/// value is its maximum, NaN stands for unknown and for points beyond the octree. Throws InvalidInput for a point that
/// is not finite.
void log_odds_at(const MapSnapshot& map, PointsView points_m, int level, float* log_odds);

/// As log_odds_at, as states (OccupancyState).
void states_at(const MapSnapshot& map, PointsView points_m, int level, std::uint8_t* states);

/// Writes, per closed box [low, high] (metres), `occupied` if any voxel that touches it is, else `unknown` if any is or
/// if it reaches beyond the octree, else `free`. Throws InvalidInput for bounds that are not finite or not in order.
void states_of_boxes(const MapSnapshot& map, PointsView low_m, PointsView high_m, std::uint8_t* states);

}  // namespace rayvox
