#pragma once
// Scan insertion with the beam engine: rays sorted by direction, octree nodes asked whether rays reach them, from the
// root down; nodes that no miss would change are left out.
#include <optional>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/insertion_workspace.hpp"
#include "rayvox/ray_shooting/scan_insertion.hpp"

namespace rayvox {

/// As insert_rays. Nothing, with the map unchanged, for scans that DirectionIndex cannot sort or whose rays
/// are too few for the space they reach through.
std::optional<ScanStatistics> insert_by_beams(MapSnapshot& map, const ScanRays& rays, InsertionWorkspace& workspace,
                                              int workers);

}  // namespace rayvox
