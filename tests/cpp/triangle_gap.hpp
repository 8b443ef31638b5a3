#pragma once
// How far two triangles are apart, by every axis that can separate them, in extended precision: the oracle of collision
// verdicts. Shares no code with the kernel.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "collision_meshes.hpp"

namespace triangle_gap {

using Real = long double;

struct Point {
  Real x, y, z;
};
inline Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Point operator*(const Point& a, Real s) { return {a.x * s, a.y * s, a.z * s}; }
inline Real dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

using Corners = std::array<Point, 3>;

/// The gap along an axis, negative by how much the projections overlap; -infinity for an axis of no length.
inline Real gap_along(const Point& axis, const Corners& a, const Corners& b) {
  const Real length = std::sqrt(dot(axis, axis));
  if (!(length > 0)) return -INFINITY;
  Real low_a = INFINITY, high_a = -INFINITY, low_b = INFINITY, high_b = -INFINITY;
  for (std::size_t i = 0; i < 3; ++i) {
    const Real on_a = dot(axis, a[i]) / length, on_b = dot(axis, b[i]) / length;
    low_a = std::min(low_a, on_a), high_a = std::max(high_a, on_a);
    low_b = std::min(low_b, on_b), high_b = std::max(high_b, on_b);
  }
  return std::max(low_b - high_a, low_a - high_b);
}

/// The least corner of `from` in the direction from an edge or corner to another: what parts segments and points.
inline Real gap_of_corners(const Corners& a, const Corners& b) {
  Real most = -INFINITY;
  for (const Point& p : a) {
    for (std::size_t j = 0; j < 3; ++j) {
      const Point edge = b[(j + 1) % 3] - b[j], across = p - b[j];
      most = std::max(most, gap_along(across, a, b));
      const Real squared = dot(edge, edge);
      if (squared > 0) most = std::max(most, gap_along(across - edge * (dot(across, edge) / squared), a, b));
    }
  }
  return most;
}

/// Separating axes of triangles, and of the segments and points they may have shrunk to.
inline Real gap(const Corners& a, const Corners& b) {
  const Point normal_a = cross(a[1] - a[0], a[2] - a[0]), normal_b = cross(b[1] - b[0], b[2] - b[0]);
  Real most = std::max(gap_along(normal_a, a, b), gap_along(normal_b, a, b));
  for (std::size_t i = 0; i < 3; ++i) {
    const Point edge_a = a[(i + 1) % 3] - a[i], edge_b = b[(i + 1) % 3] - b[i];
    most = std::max({most, gap_along(cross(normal_a, edge_a), a, b), gap_along(cross(normal_b, edge_b), a, b)});
    for (std::size_t j = 0; j < 3; ++j) most = std::max(most, gap_along(cross(edge_a, b[(j + 1) % 3] - b[j]), a, b));
  }
  return std::max({most, gap_of_corners(a, b), gap_of_corners(b, a)});
}

inline Point placed(const collision_meshes::Matrix& m, const double* p) {
  const auto row = [&](std::size_t r) {
    return Real{m[4 * r]} * p[0] + Real{m[4 * r + 1]} * p[1] + Real{m[4 * r + 2]} * p[2] + m[4 * r + 3];
  };
  return {row(0), row(1), row(2)};
}

/// The least gap of any pair of triangles of two soups, b placed by the pose; pairs more than `enough` apart by their
/// boxes are not looked at.
inline Real least_gap(const collision_meshes::Soup& a, const collision_meshes::Soup& b,
                      const collision_meshes::Matrix& pose, Real enough) {
  const auto corners_of = [](const collision_meshes::Soup& soup, const collision_meshes::Matrix& m) {
    std::vector<Corners> all(soup.triangles.size() / 3);
    for (std::size_t i = 0; i < soup.triangles.size(); ++i)
      all[i / 3][i % 3] = placed(m, &soup.vertices[3 * static_cast<std::size_t>(soup.triangles[i])]);
    return all;
  };
  const std::vector<Corners> all_a = corners_of(a, collision_meshes::identity()), all_b = corners_of(b, pose);
  Real least = INFINITY;
  for (const Corners& s : all_a) {
    for (const Corners& t : all_b) {
      const Real apart = std::max({gap_along({1, 0, 0}, s, t), gap_along({0, 1, 0}, s, t), gap_along({0, 0, 1}, s, t)});
      least = std::min(least, apart > enough ? apart : gap(s, t));
    }
  }
  return least;
}

}  // namespace triangle_gap
