#include "rayvox/octree/box.hpp"

#include <string>

#include "rayvox/error.hpp"

namespace rayvox {

CellBox cells_touching(const MapGeometry& geometry, const Vec3d& low_m, const Vec3d& high_m, const char* name) {
  CellBox box{};
  const Vec3d low = geometry.to_voxel_units(low_m), high = geometry.to_voxel_units(high_m);
  const double half = geometry.half_extent();
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(low_m[i]) || !std::isfinite(high_m[i]) || low_m[i] > high_m[i]) {
      throw InvalidInput(std::string(name) + ": box bounds must be finite and in order, got " +
                         std::to_string(low_m[i]) + " to " + std::to_string(high_m[i]) + " on axis " +
                         std::to_string(i));
    }
    box.low[i] = static_cast<std::int32_t>(std::floor(std::clamp(low[i], -half, half)));
    box.high[i] = static_cast<std::int32_t>(std::floor(std::clamp(high[i], -half - 1, half - 1)));
  }
  return box;
}

}  // namespace rayvox
