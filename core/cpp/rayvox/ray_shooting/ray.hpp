#pragma once
#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// The exact segment from origin to end, both in voxel units of the map frame.
///
/// The cells it passes are those that contain one of its points; cells are half-open, [k, k + 1). So an axis walked
/// upwards enters its next cell at the very parameter where the border is met, an axis walked downwards just after it.
/// Crossings at the same parameter and in the same sense happen together: a ray through an edge steps diagonally.
struct Ray {
  Vec3d origin, end;
};

}  // namespace rayvox
