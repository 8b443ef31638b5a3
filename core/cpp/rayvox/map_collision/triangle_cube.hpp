#pragma once
#include "rayvox/collision/triangle.hpp"

namespace rayvox {

/// Whether a closed triangle and the closed cube around the origin with half edge `half` have a point in common: the
/// separating axis test of Akenine-Moller (2001) in float64. Never false for a pair that does; true for a pair less
/// than about 1e-14 of its size apart.
bool triangle_meets_cube(const Triangle& triangle, double half);

}  // namespace rayvox
