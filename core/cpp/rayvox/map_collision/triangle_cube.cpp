#include "rayvox/map_collision/triangle_cube.hpp"

#include <algorithm>
#include <cmath>

namespace rayvox {
namespace {

// A direction is used as it is computed, and all three corners are projected on it: only the rounding of the
// projections themselves, a few units of 2^-53 of |axis| |corner|, could separate wrongly.
constexpr double rounding = 0x1p-49;

bool separates(const Vec3d& axis, const Triangle& t, double half, double size) {
  const auto along = [&](const Vec3d& p) { return axis.x * p.x + axis.y * p.y + axis.z * p.z; };
  const double a = along(t[0]), b = along(t[1]), c = along(t[2]);
  const double reach = (half + rounding * size) * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
  return std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach;
}

Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace

bool triangle_meets_cube(const Triangle& t, double half) {
  double size = half;
  for (const Vec3d& p : t) size = std::max({size, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const Vec3d unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Vec3d edge[3] = {t[1] - t[0], t[2] - t[1], t[0] - t[2]};
  for (const Vec3d& axis : unit) {
    if (separates(axis, t, half, size)) return false;
  }
  if (separates(cross(edge[0], edge[1]), t, half, size)) return false;
  for (const Vec3d& e : edge) {
    for (const Vec3d& u : unit) {
      if (separates(cross(e, u), t, half, size)) return false;
    }
  }
  return true;
}

}  // namespace rayvox
