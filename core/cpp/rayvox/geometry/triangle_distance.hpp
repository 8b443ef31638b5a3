#pragma once
// Exact distances to one triangle, float64. Degenerate triangles are the segments or points that they are.
#include "rayvox/geometry/triangle_mesh.hpp"

namespace rayvox {

/// Closest point of a triangle (Ericson: Real-Time Collision Detection, 5.1.5).
Vec3d closest_point(const Triangle& triangle, const Vec3d& p);
double squared_distance(const Triangle& triangle, const Vec3d& p);

/// Squared distance between two segments, either of which may be a point (Ericson, 5.1.9).
double squared_distance_of_segments(const Vec3d& p1, const Vec3d& q1, const Vec3d& p2, const Vec3d& q2);

/// Squared distance between a segment and a triangle; 0, but for rounding, where they meet.
double squared_distance(const Triangle& triangle, const Vec3d& from, const Vec3d& to);

}  // namespace rayvox
