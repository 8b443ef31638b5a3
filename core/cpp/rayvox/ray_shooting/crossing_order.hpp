#pragma once
// Which border does a ray cross first? Decided exactly: float64 where its error bound allows, expansion arithmetic
// (Shewchuk 1997) where not. Every engine comes here for the crossings its own arithmetic cannot tell apart.
#include <cstdint>

#include "rayvox/ray_shooting/ray.hpp"

namespace rayvox {

/// A ray meets the plane coordinate[axis] == border, which lies ahead of its origin (or at it) in the sense it walks.
struct Crossing {
  int axis;
  double border;  // an integer
};

/// Negative, zero or positive as crossing a comes before, together with or after crossing b (see Ray for ties).
int compare_crossings(const Ray& ray, const Crossing& a, const Crossing& b);

/// Of the candidate axes (bit i: axis i, at least one), those that leave `cell` first; several only if they leave
/// together.
std::uint8_t first_axes_to_leave(const Ray& ray, const Cell& cell, std::uint8_t candidates);

/// Whether the ray passes `cell` and ends in another one.
bool passes_before_end(const Ray& ray, const Cell& cell);

}  // namespace rayvox
