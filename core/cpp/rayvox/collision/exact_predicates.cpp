#include "rayvox/collision/exact_predicates.hpp"

#include <cmath>

#include "rayvox/geometry/expansion.hpp"

namespace rayvox {
namespace {

constexpr double unit_roundoff = 0x1p-53;
// Shewchuk's error bounds of the plain evaluation, relative to the sum of the terms' magnitudes.
constexpr double bound_2d = (3 + 16 * unit_roundoff) * unit_roundoff;
constexpr double bound_3d = (7 + 56 * unit_roundoff) * unit_roundoff;

int sign_of(double value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }

int exact_orient2d(double ax, double ay, double bx, double by, double cx, double cy) {
  return (difference(ax, cx) * difference(by, cy) - difference(ay, cy) * difference(bx, cx)).sign();
}

int exact_orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  const auto adx = difference(a.x, d.x), ady = difference(a.y, d.y), adz = difference(a.z, d.z);
  const auto bdx = difference(b.x, d.x), bdy = difference(b.y, d.y), bdz = difference(b.z, d.z);
  const auto cdx = difference(c.x, d.x), cdy = difference(c.y, d.y), cdz = difference(c.z, d.z);
  const auto by_a = adz * (bdx * cdy - cdx * bdy);
  const auto by_b = bdz * (cdx * ady - adx * cdy);
  const auto by_c = cdz * (adx * bdy - bdx * ady);
  return (by_a + by_b + by_c).sign();
}

}  // namespace

int orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  const double adx = a.x - d.x, ady = a.y - d.y, adz = a.z - d.z;
  const double bdx = b.x - d.x, bdy = b.y - d.y, bdz = b.z - d.z;
  const double cdx = c.x - d.x, cdy = c.y - d.y, cdz = c.z - d.z;
  const double bc = bdx * cdy, cb = cdx * bdy, ca = cdx * ady, ac = adx * cdy, ab = adx * bdy, ba = bdx * ady;
  const double determinant = adz * (bc - cb) + bdz * (ca - ac) + cdz * (ab - ba);
  const double magnitude = (std::abs(bc) + std::abs(cb)) * std::abs(adz) +
                           (std::abs(ca) + std::abs(ac)) * std::abs(bdz) +
                           (std::abs(ab) + std::abs(ba)) * std::abs(cdz);
  if (std::abs(determinant) > bound_3d * magnitude) return sign_of(determinant);
  return exact_orient3d(a, b, c, d);
}

std::array<int, 3> orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const std::array<Vec3d, 3>& d) {
  // Minus det[a - c, b - c, d - c], which shares the minors; Shewchuk's bound is of any such expansion.
  const Vec3d u = a - c, v = b - c;
  const double yz = u.y * v.z, zy = u.z * v.y, zx = u.z * v.x, xz = u.x * v.z, xy = u.x * v.y, yx = u.y * v.x;
  const double nx = yz - zy, ny = zx - xz, nz = xy - yx;
  const double mx = std::abs(yz) + std::abs(zy), my = std::abs(zx) + std::abs(xz), mz = std::abs(xy) + std::abs(yx);
  std::array<int, 3> sides;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d w = d[i] - c;
    const double determinant = w.x * nx + w.y * ny + w.z * nz;
    const double magnitude = mx * std::abs(w.x) + my * std::abs(w.y) + mz * std::abs(w.z);
    const bool certain = std::abs(determinant) > bound_3d * magnitude;
    sides[i] = certain ? -sign_of(determinant) : orient3d(a, b, c, d[i]);
  }
  return sides;
}

int orient2d(const Vec3d& a, const Vec3d& b, const Vec3d& c, int axis) {
  const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  const double left = (a[u] - c[u]) * (b[v] - c[v]), right = (a[v] - c[v]) * (b[u] - c[u]);
  const double determinant = left - right;
  if (std::abs(determinant) > bound_2d * (std::abs(left) + std::abs(right))) return sign_of(determinant);
  return exact_orient2d(a[u], a[v], b[u], b[v], c[u], c[v]);
}

}  // namespace rayvox
