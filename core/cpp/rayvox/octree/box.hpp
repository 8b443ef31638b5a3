#pragma once
#include <algorithm>

#include "rayvox/octree/map_geometry.hpp"

namespace rayvox {

/// Cells low[i] to high[i], both included.
struct CellBox {
  Cell low, high;

  bool empty() const { return low[0] > high[0] || low[1] > high[1] || low[2] > high[2]; }
  /// Whether the node of 2^level cells from `first` on overlaps the box / lies in it.
  bool overlaps(const Cell& first, int level) const {
    const std::int32_t size = std::int32_t{1} << level;
    for (int i = 0; i < 3; ++i) {
      if (first[i] > high[i] || first[i] + (size - 1) < low[i]) return false;
    }
    return true;
  }
  bool contains(const Cell& first, int level) const {
    const std::int32_t size = std::int32_t{1} << level;
    for (int i = 0; i < 3; ++i) {
      if (first[i] < low[i] || first[i] + (size - 1) > high[i]) return false;
    }
    return true;
  }
};

/// The cells that touch the closed box [low_m, high_m]; the part outside the octree is cut away. Throws InvalidInput
/// naming `name` unless the bounds are finite and in order.
CellBox cells_touching(const MapGeometry& geometry, const Vec3d& low_m, const Vec3d& high_m, const char* name);

/// First cell of child `index` (x + 2y + 4z) of the node at `first`, `level`.
inline Cell child_cell(const Cell& first, int level, int index) {
  const std::int32_t half = std::int32_t{1} << (level - 1);
  return {first[0] + (index & 1 ? half : 0), first[1] + (index & 2 ? half : 0), first[2] + (index & 4 ? half : 0)};
}

inline Cell root_cell(const MapGeometry& geometry) {
  return {-geometry.half_extent(), -geometry.half_extent(), -geometry.half_extent()};
}

}  // namespace rayvox
