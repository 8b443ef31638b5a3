#include "rayvox/octree/map_geometry.hpp"

#include <string>

#include "rayvox/error.hpp"

namespace rayvox {
MapGeometry::MapGeometry(double resolution_m, int depth) : resolution_m_(resolution_m), depth_(depth) {
  if (!(std::isfinite(resolution_m) && resolution_m > 0)) {
    throw InvalidInput("resolution_m must be finite and positive, got " + std::to_string(resolution_m));
  }
  if (depth < min_depth || depth > max_depth) {
    throw InvalidInput("depth must be from 4 to 21, got " + std::to_string(depth));
  }
}

}  // namespace rayvox
