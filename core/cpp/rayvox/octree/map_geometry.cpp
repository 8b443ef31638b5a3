#include "rayvox/octree/map_geometry.hpp"

#include <string>

#include "rayvox/error.hpp"

namespace rayvox {
namespace {

// Exact comparisons of ray crossings multiply coordinate differences; keeping non-zero coordinates at 2^-200 voxels or
// more keeps every product's last bit above float64's underflow. The cell is unchanged.
double away_from_underflow(double u) {
  constexpr double tiny = 0x1p-200;
  return u != 0 && std::abs(u) < tiny ? std::copysign(tiny, u) : u;
}

}  // namespace

MapGeometry::MapGeometry(double resolution_m, int depth) : resolution_m_(resolution_m), depth_(depth) {
  if (!(std::isfinite(resolution_m) && resolution_m > 0)) {
    throw InvalidInput("resolution_m must be finite and positive, got " + std::to_string(resolution_m));
  }
  if (depth < min_depth || depth > max_depth) {
    throw InvalidInput("depth must be from 4 to 21, got " + std::to_string(depth));
  }
}

Vec3d MapGeometry::to_voxel_units(const Vec3d& p) const {
  return {away_from_underflow(p.x / resolution_m_), away_from_underflow(p.y / resolution_m_),
          away_from_underflow(p.z / resolution_m_)};
}

}  // namespace rayvox
