#pragma once
// The octree as a stream of nodes in traversal order, in OctoMap's two layouts (OcTreeBaseImpl::writeNodesRecurs and
// OcTree::writeBinaryNode). The headers around them are octomap_file's.
#include <cstdint>
#include <span>
#include <string>

#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// .ot: per node its log-odds (float32, an inner node's is its maximum) and a byte with a bit per child that exists.
std::string write_nodes(const MapSnapshot& map);

/// .bt: per inner node two bits per child: 00 unknown, 01 occupied, 10 free, 11 inner (low bit first). Only occupied or
/// free survives.
std::string write_binary_nodes(const MapSnapshot& map);

/// Inverse of write_nodes: the root slot. Throws MapFormatError for a truncated, overlong or too deep stream and for
/// log-odds that are not finite.
Child read_nodes(std::span<const char> bytes, int depth);

/// Inverse of write_binary_nodes: occupied leaves get clamp_max, free ones clamp_min, as OctoMap's reader sets them.
Child read_binary_nodes(std::span<const char> bytes, int depth, const SensorModel& model);

}  // namespace rayvox
