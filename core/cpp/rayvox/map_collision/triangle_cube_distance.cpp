#include "rayvox/map_collision/triangle_cube_distance.hpp"

#include <algorithm>
#include <cmath>

#include "rayvox/geometry/triangle_distance.hpp"

namespace rayvox {
namespace {

// Coordinates are good to some units of 2^-53 of the size. So is the distance between two points, but the slope that
// says where along an edge the nearest one lies is only good to size / distance times that, and so its distance.
constexpr double rounding = 0x1p-48;

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Vec3d nearest_in_cube(const Vec3d& p, double half) {
  return {std::clamp(p.x, -half, half), std::clamp(p.y, -half, half), std::clamp(p.z, -half, half)};
}

// The point of a segment nearest to the cube. Half the slope of the squared distance, the product of the direction and
// the way from the cube to the point, never falls along the segment, and is linear between the planes of the cube's
// faces: those narrow the interval in which it changes sign.
Vec3d nearest_to_cube(const Vec3d& from, const Vec3d& to, double half) {
  const Vec3d direction = to - from;
  const auto at = [&](double t) { return from + direction * t; };
  const auto slope = [&](const Vec3d& p) { return dot(direction, p - nearest_in_cube(p, half)); };
  double low = 0, high = 1, slope_low = slope(from), slope_high = slope(to);
  if (slope_low >= 0) return from;
  if (slope_high <= 0) return to;
  for (int c = 0; c < 3; ++c) {
    for (const double face : {-half, half}) {
      const double t = (face - from[c]) / direction[c];
      if (!(t > low && t < high)) continue;
      const double slope_t = slope(at(t));
      (slope_t < 0 ? low : high) = t;
      (slope_t < 0 ? slope_low : slope_high) = slope_t;
    }
  }
  return at(low + (high - low) * (slope_low / (slope_low - slope_high)));
}

}  // namespace

Separation distance_to_cube(const Triangle& t, double half) {
  Separation nearest{INFINITY, {}, {}};
  const auto consider = [&](const Vec3d& on_triangle, const Vec3d& on_cube) {
    const double distance = norm(on_triangle - on_cube);
    if (distance < nearest.distance) nearest = {distance, on_triangle, on_cube};
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d p = nearest_to_cube(t[i], t[(i + 1) % 3], half);
    consider(p, nearest_in_cube(p, half));
  }
  // An inner point of the triangle is nearest only along its normal, and then a corner of the cube is nearest to it.
  const Vec3d normal = cross(t[1] - t[0], t[2] - t[0]);
  const double height = dot(normal, t[0]);
  if (std::abs(height) > half * (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z))) {
    const double side = std::copysign(half, height);
    const Vec3d corner{std::copysign(side, side * normal.x), std::copysign(side, side * normal.y),
                       std::copysign(side, side * normal.z)};
    consider(closest_point(t, corner), corner);
  }
  double size = half;
  for (const Vec3d& p : t) size = std::max({size, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const double error = rounding * size * (1 + size / nearest.distance);
  nearest.distance = nearest.distance > error ? nearest.distance - error : 0;
  return nearest;
}

}  // namespace rayvox
