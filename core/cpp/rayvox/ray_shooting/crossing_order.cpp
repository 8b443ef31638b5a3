#include "rayvox/ray_shooting/crossing_order.hpp"

#include <algorithm>
#include <cmath>

#include "rayvox/geometry/expansion.hpp"
#include "rayvox/octree/map_geometry.hpp"

namespace rayvox {
namespace {

// The sign of t_a - t_b, where t_i = (border_i - origin_i) / (end_i - origin_i). Multiplied by both (same-signed)
// denominators' magnitudes it is a difference of two products.
int compare_parameters(const Ray& ray, const Crossing& a, const Crossing& b) {
  const double oa = ray.origin[a.axis], ob = ray.origin[b.axis], ea = ray.end[a.axis], eb = ray.end[b.axis];
  const double left = std::abs(a.border - oa) * std::abs(eb - ob);
  const double right = std::abs(b.border - ob) * std::abs(ea - oa);
  // Both at the origin itself, as for every ray of a sensor that stands on a cell corner.
  if (left == 0 && right == 0) return 0;
  // Three roundings of at most 2^-53 on either side.
  if (std::abs(left - right) > 0x1p-50 * (left > right ? left : right)) return left < right ? -1 : 1;

  const int difference_sign =
      (difference(a.border, oa) * difference(eb, ob) - difference(b.border, ob) * difference(ea, oa)).sign();
  // (a.border - oa)(eb - ob) has the sign of (ea - oa)(eb - ob).
  return (ea > oa) == (eb > ob) ? difference_sign : -difference_sign;
}

}  // namespace

int compare_crossings(const Ray& ray, const Crossing& a, const Crossing& b) {
  if (const int order = compare_parameters(ray, a, b); order != 0) return order;
  const int a_downwards = ray.end[a.axis] < ray.origin[a.axis];
  const int b_downwards = ray.end[b.axis] < ray.origin[b.axis];
  return a_downwards - b_downwards;
}

std::uint8_t first_axes_to_leave(const Ray& ray, const Cell& cell, std::uint8_t candidates) {
  const auto crossing = [&](int axis) {
    return Crossing{axis, static_cast<double>(cell[axis]) + (ray.end[axis] > ray.origin[axis] ? 1 : 0)};
  };
  int first = -1;
  std::uint8_t together = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(candidates >> axis & 1)) continue;
    const int order = first < 0 ? -1 : compare_crossings(ray, crossing(axis), crossing(first));
    if (order < 0) {
      first = axis;
      together = 0;
    }
    if (order <= 0) together |= static_cast<std::uint8_t>(1u << axis);
  }
  return together;
}

bool passes_before_end(const Ray& ray, const Cell& cell) {
  const Cell start = MapGeometry::cell_of(ray.origin), end = MapGeometry::cell_of(ray.end);
  if (cell == end) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax(start[axis], end[axis]);
    if (cell[axis] < low || cell[axis] > high) return false;
  }
  // Passed if every axis that must enter the cell's slab does so before any other axis leaves its own.
  for (int in = 0; in < 3; ++in) {
    if (cell[in] == start[in]) continue;
    const Crossing enters{in, static_cast<double>(end[in] > start[in] ? cell[in] : cell[in] + 1)};
    for (int out = 0; out < 3; ++out) {
      if (out == in || cell[out] == end[out]) continue;
      const Crossing leaves{out, static_cast<double>(end[out] > start[out] ? cell[out] + 1 : cell[out])};
      if (compare_crossings(ray, enters, leaves) >= 0) return false;
    }
  }
  return true;
}

}  // namespace rayvox
