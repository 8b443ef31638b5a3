#pragma once
// Map files: OctoMap's .bt and .ot (byte for byte as its library writes them) and occupied leaves as PLY.
#include <span>
#include <string>

#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// Throw InvalidInput for a map whose depth is not OctoMap's 16.
std::string to_bt(const MapSnapshot& map);
std::string to_ot(const MapSnapshot& map);

/// Occupied leaves as binary little-endian PLY vertices: x, y, z (float64, leaf centre, metres), size (edge, metres),
/// log_odds.
std::string to_ply(const MapSnapshot& map);

/// Reads .bt or .ot, told apart by their first line. Throws MapFormatError saying what is wrong.
MapSnapshot read_octomap(std::span<const char> bytes, const SensorModel& model);

}  // namespace rayvox
