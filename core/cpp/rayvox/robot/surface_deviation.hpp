#pragma once
// How far a simplified mesh strays from the original, proven and not sampled.
#include "rayvox/geometry/triangle_mesh.hpp"
#include "rayvox/geometry/triangle_tree.hpp"

namespace rayvox {

/// An upper bound of the distance from any point of the original's surface to the simplified surface (the one-sided
/// Hausdorff distance), at most `limit_m`; infinity where the distance is larger, or could not be bounded by it.
///
/// The bound is loose by at most a tenth of limit_m or a twentieth of itself. Branch and bound over the original's
/// triangles (Tang, Lee, Kim: Interactive Hausdorff distance computation for general polygonal models, SIGGRAPH 2009,
/// section 4): the distance to one simplified triangle, a convex set, is a convex function, so over an original
/// triangle it is largest at a corner; a triangle whose corners do not agree on a near one is divided into four.
/// Vertices that no triangle uses count as well.
double surface_deviation(const TriangleMeshView& original, const TriangleTree& simplified, double limit_m);

}  // namespace rayvox
