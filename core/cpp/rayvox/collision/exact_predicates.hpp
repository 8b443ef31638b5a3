#pragma once
// Signs of determinants, exact for any float64 input that neither over- nor underflows (Shewchuk, "Adaptive Precision
// Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997: an error-bounded float64 evaluation first,
// expansions where that cannot tell).
#include <array>

#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// Sign (-1, 0, 1) of det[a - d, b - d, c - d]: which side of the plane through a, b and c the point d is on.
int orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

/// orient3d of each of three points d, for less than three times its cost.
std::array<int, 3> orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const std::array<Vec3d, 3>& d);

/// Sign of det[a - c, b - c] of the points' projections along `axis`: which side of the line ab the point c is on.
int orient2d(const Vec3d& a, const Vec3d& b, const Vec3d& c, int axis);

}  // namespace rayvox
