#pragma once
// A scan made ready for the map: validated, transformed, cut at its range, in voxel units. Making it touches no map, so
// it can be done in any thread and before anything is written to disk.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "rayvox/geometry/points_view.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/octree/map_geometry.hpp"
#include "rayvox/ray_shooting/ray.hpp"

namespace rayvox {

struct Scan {
  PointsView points_sensor;     // end points, metres
  PointsView no_return_sensor;  // direction times range of rays that met nothing, metres
  RigidTransform T_map_sensor;
  Vec3d origin_sensor_m;    // beam origin
  double max_range_m = 0;   // 0: unlimited
  bool discretize = false;  // one ray per end-point voxel, to the voxel's centre (OctoMap's `discretize`)
};

/// Leaves new elements as they are: a scan's arrays are written whole right after they are made.
template <class T>
struct UninitializedAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = UninitializedAllocator<U>;
  };
  template <class U>
  void construct(U* at) noexcept {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
  }
};

struct ScanRays {
  template <class T>
  using Array = std::vector<T, UninitializedAllocator<T>>;

  Vec3d origin;                   // voxel units, as everything here
  Array<double> end[3];           // structure of arrays
  Array<std::uint8_t> marks_end;  // 0 for a ray that was cut or met nothing: its last cell is not touched

  std::size_t count() const { return marks_end.size(); }
  std::size_t bytes() const { return count() * (3 * sizeof(double) + 1); }
  Ray operator[](std::size_t i) const { return {origin, {end[0][i], end[1][i], end[2][i]}}; }
};

/// Throws InvalidInput for an empty scan, NaN or infinity, naming index and value; OutOfRange for a coordinate beyond
/// the octree.
ScanRays prepare_scan(const Scan& scan, const MapGeometry& geometry);

}  // namespace rayvox
