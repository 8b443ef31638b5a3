#include "rayvox/ray_shooting/cast_ray.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/occupied_scene.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"
#include "rayvox/ray_shooting/stop_finder.hpp"

namespace rayvox {
namespace {

// The part of the ray inside the octree; `leaves` if there is more.
struct ClippedRay {
  Ray ray;
  double length_m;
  bool leaves = false;
};

ClippedRay clip(const MapGeometry& geometry, const Vec3d& origin_m, const Vec3d& unit, double max_range_m) {
  const double half = geometry.half_extent();
  const double half_m = half * geometry.resolution_m();
  double exit_m = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (unit[axis] != 0) exit_m = std::min(exit_m, (std::copysign(half_m, unit[axis]) - origin_m[axis]) / unit[axis]);
  }
  ClippedRay clipped{};
  clipped.leaves = !(max_range_m > 0 && max_range_m < exit_m);
  clipped.length_m = clipped.leaves ? exit_m : max_range_m;
  clipped.ray.origin = geometry.to_voxel_units(origin_m);
  clipped.ray.end = geometry.to_voxel_units(origin_m + unit * clipped.length_m);
  // Rounding may put an end on the border just outside.
  for (int axis = 0; axis < 3; ++axis) {
    clipped.ray.end[axis] = std::clamp(clipped.ray.end[axis], -half, std::nextafter(half, 0.0));
  }
  return clipped;
}

[[noreturn]] void refuse(const char* what, std::size_t index) {
  throw InvalidInput("rays[" + std::to_string(index) + "]: " + what);
}

Vec3d unit_direction(const Vec3d& direction, std::size_t index) {
  if (!is_finite(direction)) refuse("direction is not finite", index);
  // Scaled first, so that neither huge nor tiny components overflow or vanish when squared.
  const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
  if (largest == 0) refuse("direction is zero", index);
  const Vec3d scaled{direction.x / largest, direction.y / largest, direction.z / largest};
  return scaled * (1.0 / norm(scaled));
}

struct RayHit {
  HitKind kind;
  double t_m;
  Cell voxel;
};

ClippedRay checked_ray(const MapSnapshot& map, const Vec3d& origin_m, const Vec3d& direction, double max_range_m,
                       std::size_t index) {
  if (!is_finite(origin_m)) refuse("origin is not finite", index);
  if (!(max_range_m >= 0)) refuse("max_range_m must be positive", index);
  if (!map.geometry.contains(map.geometry.to_voxel_units(origin_m))) {
    throw OutOfRange("rays[" + std::to_string(index) + "]: origin is beyond the octree's range");
  }
  return clip(map.geometry, origin_m, unit_direction(direction, index), max_range_m);
}

RayHit miss(const ClippedRay& clipped, bool unknown_stops) {
  const bool enters_outside = clipped.leaves && unknown_stops;
  return {enters_outside ? HitKind::unknown_entered : HitKind::nothing, clipped.length_m,
          MapGeometry::cell_of(clipped.ray.end)};
}

RayHit cast_ray(const MapSnapshot& map, const ClippedRay& clipped, bool unknown_stops) {
  RayWalker walker(clipped.ray);
  StopFinder finder(map, unknown_stops);
  for (;;) {
    const StopFinder::Stop stop = finder.find(walker.cell());
    if (stop.kind != StopFinder::Kind::none) {
      const HitKind kind = stop.kind == StopFinder::Kind::occupied ? HitKind::occupied : HitKind::unknown_entered;
      return {kind, walker.t() * clipped.length_m, walker.cell()};
    }
    if (walker.end_in_block(stop.level)) break;
    walker.leave_block(stop.level);
  }
  return miss(clipped, unknown_stops);
}

RayHit cast_ray(const MapSnapshot& map, const OccupiedScene& scene, const ClippedRay& clipped) {
  OccupiedScene::Hit hit;
  switch (scene.cast(clipped.ray, hit)) {
    case OccupiedScene::Answer::hit: return {HitKind::occupied, hit.t * clipped.length_m, hit.voxel};
    case OccupiedScene::Answer::nothing: return miss(clipped, false);
    case OccupiedScene::Answer::undecided: break;
  }
  return cast_ray(map, clipped, false);
}

// Writes cast(ray) for every ray.
template <class Cast>
void for_all_rays(const MapSnapshot& map, PointsView origins_m, PointsView directions, double max_range_m,
                  const RayHits& hits, const Cast& cast) {
  constexpr std::size_t rays_per_chunk = 512;
  const std::size_t count = origins_m.count;
  parallel_for((count + rays_per_chunk - 1) / rays_per_chunk, [&](std::size_t chunk, int) {
    const std::size_t last = std::min(count, (chunk + 1) * rays_per_chunk);
    for (std::size_t i = chunk * rays_per_chunk; i < last; ++i) {
      const RayHit hit = cast(checked_ray(map, origins_m[i], directions[i], max_range_m, i));
      hits.kind[i] = static_cast<std::uint8_t>(hit.kind);
      hits.t_m[i] = hit.t_m;
      std::copy(hit.voxel.begin(), hit.voxel.end(), hits.voxel + 3 * i);
    }
  });
}

}  // namespace

void cast_rays(const MapSnapshot& map, PointsView origins_m, PointsView directions, double max_range_m,
               bool unknown_stops, const RayHits& hits) {
  for_all_rays(map, origins_m, directions, max_range_m, hits,
               [&](const ClippedRay& ray) { return cast_ray(map, ray, unknown_stops); });
}

bool cast_rays_by_embree(const MapSnapshot& map, PointsView origins_m, PointsView directions, double max_range_m,
                         std::size_t most_leaves, const RayHits& hits) {
  const std::optional<OccupiedScene> scene = OccupiedScene::of(map, EmbreeLibrary::get(), most_leaves);
  if (!scene) return false;
  for_all_rays(map, origins_m, directions, max_range_m, hits,
               [&](const ClippedRay& ray) { return cast_ray(map, *scene, ray); });
  return true;
}

}  // namespace rayvox
