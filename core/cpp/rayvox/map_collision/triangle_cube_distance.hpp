#pragma once
#include "rayvox/collision/triangle.hpp"

namespace rayvox {

/// Where a triangle and a cube are nearest to each other.
struct Separation {
  double distance = 0;  ///< never more than the true one
  Vec3d on_triangle, on_cube;
};

/// The distance between a closed triangle and the closed cube around the origin with half edge `half`, which have no
/// point in common, in float64. It is rounded down: by some 1e-14 of the larger of distance and size, and by as much
/// again for every time that the size (largest coordinate or half edge) exceeds the distance. Degenerate triangles are
/// the segments or points that they are.
Separation distance_to_cube(const Triangle& triangle, double half);

}  // namespace rayvox
