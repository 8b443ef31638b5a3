#pragma once
#include <cstddef>

#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// n x 3 coordinates, row-major, float32 or float64 (one of the two pointers is null).
struct PointsView {
  const float* f32 = nullptr;
  const double* f64 = nullptr;
  std::size_t count = 0;

  Vec3d operator[](std::size_t i) const {
    return f32 ? Vec3d{f32[3 * i], f32[3 * i + 1], f32[3 * i + 2]} : Vec3d{f64[3 * i], f64[3 * i + 1], f64[3 * i + 2]};
  }
};

}  // namespace rayvox
