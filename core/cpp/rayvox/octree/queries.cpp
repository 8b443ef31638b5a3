#include "rayvox/octree/queries.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/octree/box.hpp"
#include "rayvox/octree/node_cursor.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

OccupancyState state_below(const NodeCursor& node, const Cell& first, const CellBox& box, const SensorModel& model) {
  if (node.kind() == NodeCursor::Kind::unknown) return OccupancyState::unknown;
  if (node.kind() == NodeCursor::Kind::leaf) {
    return model.is_occupied(node.log_odds()) ? OccupancyState::occupied : OccupancyState::free;
  }
  // Where everything below is known and free there is nothing to look for.
  if (!node.brick() && !model.is_occupied(node.log_odds()) && !node.slot().inner()->summary.any_unknown) {
    return OccupancyState::free;
  }
  OccupancyState state = OccupancyState::free;
  for (int i = 0; i < 8; ++i) {
    const Cell child_first = child_cell(first, node.level(), i);
    if (!box.overlaps(child_first, node.level() - 1)) continue;
    const OccupancyState below = state_below(node.child(i), child_first, box, model);
    if (below == OccupancyState::occupied) return below;
    if (below == OccupancyState::unknown) state = below;
  }
  return state;
}

constexpr std::size_t queries_per_chunk = 4096;

template <class Body>
void for_each_query(std::size_t count, const Body& body) {
  parallel_for((count + queries_per_chunk - 1) / queries_per_chunk, [&](std::size_t chunk, int) {
    const std::size_t last = std::min(count, (chunk + 1) * queries_per_chunk);
    for (std::size_t i = chunk * queries_per_chunk; i < last; ++i) body(i);
  });
}

float log_odds_of(const MapSnapshot& map, const Vec3d& point_m, int level, std::size_t index) {
  if (!is_finite(point_m)) throw InvalidInput("points[" + std::to_string(index) + "] is not finite");
  const Vec3d u = map.geometry.to_voxel_units(point_m);
  if (!map.geometry.contains(u)) return std::numeric_limits<float>::quiet_NaN();
  const std::uint64_t code = map.geometry.morton_of(MapGeometry::cell_of(u));
  NodeCursor node(map.root, map.geometry.depth());
  while (node.kind() == NodeCursor::Kind::inner && node.level() > level) {
    node = node.child(static_cast<int>(code >> (3 * (node.level() - 1)) & 7));
  }
  return node.kind() == NodeCursor::Kind::unknown ? std::numeric_limits<float>::quiet_NaN() : node.log_odds();
}

OccupancyState state_of_box(const MapSnapshot& map, const Vec3d& low_m, const Vec3d& high_m, std::size_t index) {
  const CellBox box = cells_touching(map.geometry, low_m, high_m, ("boxes[" + std::to_string(index) + "]").c_str());
  if (box.empty()) return OccupancyState::unknown;
  const OccupancyState inside =
      state_below(NodeCursor(map.root, map.geometry.depth()), root_cell(map.geometry), box, map.model);
  const bool reaches_beyond = !map.geometry.contains(map.geometry.to_voxel_units(low_m)) ||
                              !map.geometry.contains(map.geometry.to_voxel_units(high_m));
  return inside == OccupancyState::free && reaches_beyond ? OccupancyState::unknown : inside;
}

}  // namespace

void log_odds_at(const MapSnapshot& map, PointsView points_m, int level, float* log_odds) {
  for_each_query(points_m.count, [&](std::size_t i) { log_odds[i] = log_odds_of(map, points_m[i], level, i); });
}

void states_at(const MapSnapshot& map, PointsView points_m, int level, std::uint8_t* states) {
  for_each_query(points_m.count, [&](std::size_t i) {
    const float value = log_odds_of(map, points_m[i], level, i);
    const OccupancyState state = std::isnan(value)              ? OccupancyState::unknown
                                 : map.model.is_occupied(value) ? OccupancyState::occupied
                                                                : OccupancyState::free;
    states[i] = static_cast<std::uint8_t>(state);
  });
}

void states_of_boxes(const MapSnapshot& map, PointsView low_m, PointsView high_m, std::uint8_t* states) {
  for_each_query(low_m.count, [&](std::size_t i) {
    states[i] = static_cast<std::uint8_t>(state_of_box(map, low_m[i], high_m[i], i));
  });
}

}  // namespace rayvox
