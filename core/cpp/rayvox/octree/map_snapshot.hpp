#pragma once
#include <cstdint>

#include "rayvox/octree/inner_node.hpp"
#include "rayvox/octree/map_geometry.hpp"
#include "rayvox/octree/sensor_model.hpp"

namespace rayvox {

/// One revision of a map, immutable and cheap to copy: it shares all nodes with the map and with other revisions.
/// Everything that reads a map reads a snapshot, from any thread, for as long as it likes.
struct MapSnapshot {
  MapGeometry geometry;
  SensorModel model;
  Child root;
  std::uint64_t root_revision = 0;  // when anything last changed
  std::uint64_t revision = 0;
  std::uint64_t first_revision = 0;  // changes before it are not known (the map was loaded then)
};

}  // namespace rayvox
