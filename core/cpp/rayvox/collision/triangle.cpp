#include "rayvox/collision/triangle.hpp"

#include <algorithm>

#include "rayvox/collision/exact_predicates.hpp"

namespace rayvox {
namespace {

bool collinear(const Vec3d& a, const Vec3d& b, const Vec3d& c, int axis) { return orient2d(a, b, c, axis) == 0; }

bool intervals_overlap(double a0, double a1, double b0, double b1) {
  return std::max(std::min(a0, a1), std::min(b0, b1)) <= std::min(std::max(a0, a1), std::max(b0, b1));
}

bool boxes_overlap(const Vec3d& p, const Vec3d& q, const Vec3d& r, const Vec3d& s) {
  for (int i = 0; i < 3; ++i) {
    if (!intervals_overlap(p[i], q[i], r[i], s[i])) return false;
  }
  return true;
}

// Whether c, known to be on the line ab of the projection, lies between a and b there.
bool between(const Vec3d& a, const Vec3d& b, const Vec3d& c, int axis) {
  const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  return intervals_overlap(a[u], b[u], c[u], c[u]) && intervals_overlap(a[v], b[v], c[v], c[v]);
}

// Segments pq and rs in the projection along `axis`.
bool segments_meet_2d(const Vec3d& p, const Vec3d& q, const Vec3d& r, const Vec3d& s, int axis) {
  const int pq_r = orient2d(p, q, r, axis), pq_s = orient2d(p, q, s, axis);
  const int rs_p = orient2d(r, s, p, axis), rs_q = orient2d(r, s, q, axis);
  if (pq_r * pq_s < 0 && rs_p * rs_q < 0) return true;
  return (pq_r == 0 && between(p, q, r, axis)) || (pq_s == 0 && between(p, q, s, axis)) ||
         (rs_p == 0 && between(r, s, p, axis)) || (rs_q == 0 && between(r, s, q, axis));
}

// Four coplanar points project one to one along an axis in whose projection they are not all on one line.
bool coplanar_segments_meet(const Vec3d& p, const Vec3d& q, const Vec3d& r, const Vec3d& s) {
  for (int axis = 0; axis < 3; ++axis) {
    const bool on_one_line =
        collinear(p, q, r, axis) && collinear(p, q, s, axis) && collinear(r, s, p, axis) && collinear(r, s, q, axis);
    if (!on_one_line) return segments_meet_2d(p, q, r, s, axis);
  }
  return boxes_overlap(p, q, r, s);
}

bool segments_meet(const Vec3d& p, const Vec3d& q, const Vec3d& r, const Vec3d& s) {
  return boxes_overlap(p, q, r, s) && orient3d(p, q, r, s) == 0 && coplanar_segments_meet(p, q, r, s);
}

bool inside_2d(const Triangle& t, const Vec3d& p, int axis) {
  const int s0 = orient2d(t[0], t[1], p, axis), s1 = orient2d(t[1], t[2], p, axis), s2 = orient2d(t[2], t[0], p, axis);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

// An axis along which the triangle does not project onto a line; -1 if it is degenerate.
int projection_axis(const Triangle& t) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!collinear(t[0], t[1], t[2], axis)) return axis;
  }
  return -1;
}

bool coplanar_segment_meets(const Vec3d& p, const Vec3d& q, const Triangle& t, int axis) {
  if (inside_2d(t, p, axis)) return true;
  for (int i = 0; i < 3; ++i) {
    if (segments_meet_2d(p, q, t[i], t[(i + 1) % 3], axis)) return true;
  }
  return false;
}

// `side_p`, `side_q`: the sides of t's plane that p and q are on.
bool segment_meets(const Vec3d& p, const Vec3d& q, int side_p, int side_q, const Triangle& t) {
  if (side_p * side_q > 0) return false;
  if (side_p == 0 && side_q == 0) {
    const int axis = projection_axis(t);
    if (axis >= 0) return coplanar_segment_meets(p, q, t, axis);
    return segments_meet(p, q, t[0], t[1]) || segments_meet(p, q, t[1], t[2]) || segments_meet(p, q, t[2], t[0]);
  }
  const int s0 = orient3d(p, q, t[0], t[1]), s1 = orient3d(p, q, t[1], t[2]), s2 = orient3d(p, q, t[2], t[0]);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

bool strictly_one_sided(const std::array<int, 3>& side) {
  return side[0] != 0 && side[0] == side[1] && side[1] == side[2];
}

bool an_edge_meets(const Triangle& edges, const std::array<int, 3>& side, const Triangle& t) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (segment_meets(edges[i], edges[j], side[i], side[j], t)) return true;
  }
  return false;
}

}  // namespace

bool triangles_touch(const Triangle& a, const Triangle& b) {
  // An extreme point of the intersection lies on an edge of one of the two.
  const std::array<int, 3> side_of_b = orient3d(a[0], a[1], a[2], b);
  if (strictly_one_sided(side_of_b)) return false;
  const std::array<int, 3> side_of_a = orient3d(b[0], b[1], b[2], a);
  if (strictly_one_sided(side_of_a)) return false;
  return an_edge_meets(a, side_of_a, b) || an_edge_meets(b, side_of_b, a);
}

bool is_degenerate(const Triangle& t) { return projection_axis(t) < 0; }

}  // namespace rayvox
