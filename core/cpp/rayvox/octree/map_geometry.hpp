#pragma once
// The octree's place in the world: resolution, number of levels, and the two ways between metres, cells and codes.
#include <cstdint>

#include "rayvox/geometry/vec3.hpp"
#include "rayvox/octree/morton.hpp"

namespace rayvox {

/// floor() for values that fit: plain x86-64 has no instruction for it, and the call costs more than the compare.
inline std::int32_t floor_to_cell(double u) {
  const auto truncated = static_cast<std::int32_t>(u);
  return truncated - (u < truncated);
}

/// Bricks hold the lowest three levels: 8x8x8 cells.
constexpr int brick_level = 3;
constexpr int min_depth = 4;
constexpr int max_depth = 21;
/// A tile is the unit of work of scan integration: up to 64x64x64 cells, below the root even in the shallowest octree.
constexpr int max_tile_level = 6;

/// `level` counts from the finest cells (0) up to the root (`depth`); OctoMap's depth of a node is `depth - level`.
class MapGeometry {
 public:
  /// Throws InvalidInput unless resolution_m is finite and positive and min_depth <= depth <= max_depth.
  MapGeometry(double resolution_m, int depth);

  double resolution_m() const { return resolution_m_; }
  int depth() const { return depth_; }
  int tile_level() const { return depth_ - 1 < max_tile_level ? depth_ - 1 : max_tile_level; }
  /// Cells run from -half_extent() to half_extent() - 1 along each axis.
  std::int32_t half_extent() const { return std::int32_t{1} << (depth_ - 1); }

  /// Metres to voxel units: one float64 division per coordinate; everything after it is exact.
  double to_voxel_units(double coordinate_m) const {
    // Exact comparisons of ray crossings multiply coordinate differences; keeping non-zero coordinates at 2^-200 voxels
    // or more keeps every product's last bit above float64's underflow. The cell is unchanged.
    constexpr double tiny = 0x1p-200;
    const double u = coordinate_m / resolution_m_;
    return std::abs(u) < tiny && u != 0 ? std::copysign(tiny, u) : u;  // one branch, hardly ever taken
  }
  Vec3d to_voxel_units(const Vec3d& point_m) const {
    return {to_voxel_units(point_m.x), to_voxel_units(point_m.y), to_voxel_units(point_m.z)};
  }

  /// True if the point (voxel units, finite) lies in the octree.
  bool contains(const Vec3d& u) const {
    const double h = half_extent();
    return u.x >= -h && u.x < h && u.y >= -h && u.y < h && u.z >= -h && u.z < h;
  }
  static Cell cell_of(const Vec3d& u) { return {floor_to_cell(u.x), floor_to_cell(u.y), floor_to_cell(u.z)}; }
  std::uint64_t morton_of(const Cell& cell) const {
    const auto h = static_cast<std::uint32_t>(half_extent());
    return morton_encode(static_cast<std::uint32_t>(cell[0]) + h, static_cast<std::uint32_t>(cell[1]) + h,
                         static_cast<std::uint32_t>(cell[2]) + h);
  }
  Cell cell_of_morton(std::uint64_t code) const {
    const std::int32_t h = half_extent();
    return {static_cast<std::int32_t>(morton_x(code)) - h, static_cast<std::int32_t>(morton_y(code)) - h,
            static_cast<std::int32_t>(morton_z(code)) - h};
  }

 private:
  double resolution_m_;
  int depth_;
};

}  // namespace rayvox
