#pragma once
#include <array>

#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

using Triangle = std::array<Vec3d, 3>;

/// Whether two closed triangles have a point in common: exact for the coordinates given. Touching counts; coplanar
/// triangles and triangles that are a segment or a point are handled.
bool triangles_touch(const Triangle& a, const Triangle& b);

/// Whether all three corners lie on one line (or in one point), exactly.
bool is_degenerate(const Triangle& t);

}  // namespace rayvox
