#pragma once
#include <array>

#include "rayvox/collision/triangle.hpp"
#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// Zeroth to second moments of a surface about the mesh's centre: area, first (x y z), second (xx xy xz yy yz zz).
struct SurfaceMoments {
  std::array<double, 10> value{};

  /// `least_weight`, an area, lets triangles of no area count a little.
  void add(const Triangle& triangle, double least_weight);
  void add(const SurfaceMoments& other);
};

/// The principal directions of a surface (rows), the direction of least spread first, orthonormal to float64 rounding.
std::array<Vec3d, 3> principal_axes(const SurfaceMoments& moments);

}  // namespace rayvox
