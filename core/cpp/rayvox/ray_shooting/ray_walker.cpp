#include "rayvox/ray_shooting/ray_walker.hpp"

#include <algorithm>
#include <limits>

#include "rayvox/octree/map_geometry.hpp"
#include "rayvox/ray_shooting/crossing_order.hpp"

namespace rayvox {

RayWalker::RayWalker(const Ray& ray)
    : ray_(ray), cell_(MapGeometry::cell_of(ray.origin)), end_cell_(MapGeometry::cell_of(ray.end)) {
  for (int axis = 0; axis < 3; ++axis) inverse_[axis] = 1 / (ray.end[axis] - ray.origin[axis]);
}

void RayWalker::leave_block(int level) {
  double t[3], border[3];
  double t_first = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    t[axis] = std::numeric_limits<double>::infinity();
    if (cell_[axis] == end_cell_[axis]) continue;
    const std::int32_t block = cell_[axis] >> level;
    border[axis] = static_cast<double>(end_cell_[axis] > cell_[axis] ? (block + 1) << level : block << level);
    t[axis] = (border[axis] - ray_.origin[axis]) * inverse_[axis];
    t_first = std::min(t_first, t[axis]);
  }
  // Each t carries four roundings of 2^-53; closer pairs are compared exactly.
  int first = -1;
  std::uint8_t together = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(t[axis] <= t_first + 0x1p-49 * t_first)) continue;
    const int order =
        first < 0 ? -1 : compare_crossings(ray_, Crossing{axis, border[axis]}, Crossing{first, border[first]});
    if (order < 0) {
      first = axis;
      together = 0;
    }
    if (order <= 0) together |= static_cast<std::uint8_t>(1u << axis);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (together >> axis & 1) {
      cell_[axis] = cell_after_crossing(axis, static_cast<std::int32_t>(border[axis]));
    } else if (level > 0 && cell_[axis] != end_cell_[axis]) {
      cell_[axis] = cell_at_crossing(axis, t_first, first, border[first]);
    }
  }
  crossed_axis_ = first;
  crossed_border_ = border[first];
}

bool RayWalker::enter_block(const Cell& first, int level) {
  double t[3], border[3];
  double t_last = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t low = first[axis], high = low + ((std::int32_t{1} << level) - 1);
    t[axis] = -1;
    if (cell_[axis] >= low && cell_[axis] <= high) continue;
    const bool upwards = cell_[axis] < low;
    if (upwards ? end_cell_[axis] < low : end_cell_[axis] > high) return false;
    border[axis] = static_cast<double>(upwards ? low : high + 1);
    t[axis] = (border[axis] - ray_.origin[axis]) * inverse_[axis];
    t_last = std::max(t_last, t[axis]);
  }
  if (t_last < 0) return true;
  // The block is entered with the last of the crossings; near-ties as in leave_block.
  int last = -1;
  for (int axis = 0; axis < 3; ++axis) {
    if (t[axis] < 0 || t[axis] < t_last - 0x1p-49 * t_last) continue;
    if (last < 0 || compare_crossings(ray_, Crossing{axis, border[axis]}, Crossing{last, border[last]}) > 0) {
      last = axis;
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == last) {
      cell_[axis] = cell_after_crossing(axis, static_cast<std::int32_t>(border[axis]));
    } else if (cell_[axis] != end_cell_[axis]) {
      cell_[axis] = cell_at_crossing(axis, t_last, last, border[last]);
    }
    if (static_cast<std::uint32_t>(cell_[axis] - first[axis]) >> level) return false;
  }
  crossed_axis_ = last;
  crossed_border_ = border[last];
  return true;
}

// The cell along `axis` at the moment the ray crosses another axis's border.
std::int32_t RayWalker::cell_at_crossing(int axis, double t, int crossed_axis, double crossed_border) const {
  const double position = ray_.origin[axis] + (ray_.end[axis] - ray_.origin[axis]) * t;
  std::int32_t cell = floor_to_cell(position);
  const double fraction = position - cell;
  // Coordinates stay below 2^21, so the position is off by less than 2^-28.
  if (fraction < 0x1p-24 || fraction > 1 - 0x1p-24) {
    const bool upwards = ray_.end[axis] > ray_.origin[axis];
    const std::int32_t border = fraction < 0.5 ? cell : cell + 1;
    // A border behind the current cell has been crossed, one behind the end's cell never is.
    const bool behind = upwards ? border <= cell_[axis] : border > cell_[axis];
    const bool beyond = upwards ? border > end_cell_[axis] : border <= end_cell_[axis];
    const bool crossed = behind || (!beyond && compare_crossings(ray_, Crossing{axis, static_cast<double>(border)},
                                                                 Crossing{crossed_axis, crossed_border}) <= 0);
    cell = upwards == crossed ? border : border - 1;
  }
  const auto [low, high] = std::minmax(cell_[axis], end_cell_[axis]);
  return std::clamp(cell, low, high);
}

}  // namespace rayvox
