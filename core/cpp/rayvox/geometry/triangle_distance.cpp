#include "rayvox/geometry/triangle_distance.hpp"

#include <algorithm>

namespace rayvox {
namespace {

// Squared sine of an angle below which a triangle's plane is not known well.
constexpr double needle = 1e-12;

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Vec3d closest_on_segment(const Vec3d& a, const Vec3d& b, const Vec3d& p) {
  const Vec3d d = b - a;
  const double length2 = dot(d, d);
  return length2 > 0 ? a + d * std::clamp(dot(p - a, d) / length2, 0.0, 1.0) : a;
}

// Where the segment meets the triangle's plane; its start where it does not.
Vec3d meets_plane(const Triangle& triangle, const Vec3d& from, const Vec3d& to) {
  const Vec3d n = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]), d = to - from;
  const double towards = dot(d, n), t = dot(triangle[0] - from, n) / towards;
  return towards != 0 && t > 0 && t < 1 ? from + d * t : from;
}

}  // namespace

double squared_distance_of_segments(const Vec3d& p1, const Vec3d& q1, const Vec3d& p2, const Vec3d& q2) {
  const Vec3d d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r);
  double s = 0, t = 0;
  if (a > 0 && e > 0) {
    const double b = dot(d1, d2), c = dot(d1, r), determinant = a * e - b * b;
    if (determinant > 0) s = std::clamp((b * f - c * e) / determinant, 0.0, 1.0);
    t = (b * s + f) / e;
    if (t < 0) {
      t = 0;
      s = std::clamp(-c / a, 0.0, 1.0);
    } else if (t > 1) {
      t = 1;
      s = std::clamp((b - c) / a, 0.0, 1.0);
    }
  } else if (a > 0) {
    s = std::clamp(-dot(d1, r) / a, 0.0, 1.0);
  } else if (e > 0) {
    t = std::clamp(f / e, 0.0, 1.0);
  }
  const Vec3d gap = (p1 + d1 * s) - (p2 + d2 * t);
  return dot(gap, gap);
}

Vec3d closest_point(const Triangle& triangle, const Vec3d& p) {
  const auto& [a, b, c] = triangle;
  const Vec3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
               d6 = dot(ac, cp);
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  const bool over = va > 0 && vb > 0 && vc > 0;
  const double area2 = va + vb + vc;  // the cross product of ab and ac, squared
  const Vec3d within = over ? a + ab * (vb / area2) + ac * (vc / area2) : a;
  if (over && area2 > needle * dot(ab, ab) * dot(ac, ac)) return within;
  // Outside of the prism over the triangle an edge is closest; a needle's weights are mostly rounding, so ask both.
  const Vec3d candidates[] = {within, closest_on_segment(a, b, p), closest_on_segment(b, c, p),
                              closest_on_segment(c, a, p)};
  return *std::min_element(std::begin(candidates), std::end(candidates),
                           [&](const Vec3d& x, const Vec3d& y) { return dot(x - p, x - p) < dot(y - p, y - p); });
}

double squared_distance(const Triangle& triangle, const Vec3d& p) {
  const Vec3d gap = closest_point(triangle, p) - p;
  return dot(gap, gap);
}

double squared_distance(const Triangle& triangle, const Vec3d& from, const Vec3d& to) {
  const auto& [a, b, c] = triangle;
  // A segment is nearest at its ends, at an edge, or where it goes through; each is the distance of some of its points,
  // so that no rounding on needles makes it too small.
  return std::min({squared_distance(triangle, meets_plane(triangle, from, to)), squared_distance(triangle, from),
                   squared_distance(triangle, to), squared_distance_of_segments(from, to, a, b),
                   squared_distance_of_segments(from, to, b, c), squared_distance_of_segments(from, to, c, a)});
}

}  // namespace rayvox
