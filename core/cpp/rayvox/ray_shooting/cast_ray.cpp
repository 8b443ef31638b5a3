#include "rayvox/ray_shooting/cast_ray.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"
#include "rayvox/ray_shooting/stop_finder.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {
namespace {

// Masks of a building's map take some ten milliseconds to make, and save a ray a microsecond (benchmarks/RESULTS.md).
constexpr std::size_t fewest_rays_for_masks = 16384;

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

HitKind kind_of(StopFinder::Kind stop) {
  return stop == StopFinder::Kind::occupied ? HitKind::occupied : HitKind::unknown_entered;
}

RayHit cast_through_octree(const MapSnapshot& map, const ClippedRay& clipped, bool unknown_stops) {
  RayWalker walker(clipped.ray);
  StopFinder finder(map, unknown_stops);
  for (;;) {
    const StopFinder::Stop stop = finder.find(walker.cell());
    if (stop.kind != StopFinder::Kind::none) {
      return {kind_of(stop.kind), walker.t() * clipped.length_m, walker.cell()};
    }
    if (walker.end_in_block(stop.level)) break;
    walker.leave_block(stop.level);
  }
  return miss(clipped, unknown_stops);
}

RayHit cast_through_scene(const MapSnapshot& map, const OccupiedScene& scene, const ClippedRay& clipped) {
  OccupiedScene::Hit hit;
  switch (scene.cast(clipped.ray, hit)) {
    case OccupiedScene::Answer::hit: return {HitKind::occupied, hit.t * clipped.length_m, hit.voxel};
    case OccupiedScene::Answer::nothing: return miss(clipped, false);
    case OccupiedScene::Answer::undecided: break;
  }
  return cast_through_octree(map, clipped, false);
}

RayHit answer_of(const MapSnapshot& map, const StopQuery& query, const ClippedRay& clipped, bool unknown_stops) {
  switch (query.answer) {
    case StopQuery::passes: return miss(clipped, unknown_stops);
    case StopQuery::undecided: return cast_through_octree(map, clipped, unknown_stops);
    case StopQuery::stopped: break;
  }
  const Cell cell{query.cell[0], query.cell[1], query.cell[2]};
  const HitKind kind = unknown_stops ? kind_of(StopFinder(map, true).find(cell).kind) : HitKind::occupied;
  return {kind, query.t * clipped.length_m, cell};
}

// A share of the rays that one thread casts at a time.
struct Share {
  static constexpr std::size_t width = 256;
  std::size_t count = 0;
  ClippedRay ray[width];
  RayHit hit[width];
};

// Calls cast(share) for all rays, and writes the hits that it leaves there.
template <class Cast>
void for_all_rays(const MapSnapshot& map, const RayBatch& rays, const RayHits& hits, const Cast& cast) {
  const std::size_t count = rays.origins_m.count;
  parallel_for((count + Share::width - 1) / Share::width, [&](std::size_t index, int) {
    Share share;
    const std::size_t first = index * Share::width;
    share.count = std::min(Share::width, count - first);
    for (std::size_t i = 0; i < share.count; ++i) {
      share.ray[i] =
          checked_ray(map, rays.origins_m[first + i], rays.directions[first + i], rays.max_range_m, first + i);
    }
    cast(share);
    for (std::size_t i = 0; i < share.count; ++i) {
      const RayHit& hit = share.hit[i];
      hits.kind[first + i] = static_cast<std::uint8_t>(hit.kind);
      hits.t_m[first + i] = hit.t_m;
      std::copy(hit.voxel.begin(), hit.voxel.end(), hits.voxel + 3 * (first + i));
    }
  });
}

void cast_through_octree(const MapSnapshot& map, const RayBatch& rays, const RayHits& hits) {
  for_all_rays(map, rays, hits, [&](Share& share) {
    for (std::size_t i = 0; i < share.count; ++i) {
      share.hit[i] = cast_through_octree(map, share.ray[i], rays.unknown_stops);
    }
  });
}

void cast_through_masks(const MapSnapshot& map, const StopMasks& masks, const RayBatch& rays, const RayHits& hits) {
  const StopTree tree = masks.tree();
  const Kernels& set = kernels();
  for_all_rays(map, rays, hits, [&](Share& share) {
    StopQuery query[Share::width];
    for (std::size_t i = 0; i < share.count; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        query[i].origin[axis] = share.ray[i].ray.origin[axis];
        query[i].end[axis] = share.ray[i].ray.end[axis];
      }
    }
    set.find_first_stops(tree, query, share.count);
    for (std::size_t i = 0; i < share.count; ++i) {
      share.hit[i] = answer_of(map, query[i], share.ray[i], rays.unknown_stops);
    }
  });
}

void cast_through_scene(const MapSnapshot& map, const OccupiedScene& scene, const RayBatch& rays, const RayHits& hits) {
  for_all_rays(map, rays, hits, [&](Share& share) {
    for (std::size_t i = 0; i < share.count; ++i) share.hit[i] = cast_through_scene(map, scene, share.ray[i]);
  });
}

}  // namespace

void cast_rays(const MapSnapshot& map, RayScenes& scenes, const RayBatch& rays, RayEngine engine, const RayHits& hits) {
  if (engine == RayEngine::automatic) {
    const bool pays = scenes.has_masks(rays.unknown_stops) || rays.origins_m.count >= fewest_rays_for_masks;
    engine = pays ? RayEngine::masks : RayEngine::octree;
  }
  if (engine == RayEngine::masks) {
    return cast_through_masks(map, scenes.masks(map, rays.unknown_stops), rays, hits);
  }
  if (engine == RayEngine::embree) {
    if (rays.unknown_stops)
      throw InvalidInput("engine 'embree' needs unknown='free': its scene holds occupied leaves only");
    if (const OccupiedScene* scene = scenes.occupied(map)) return cast_through_scene(map, *scene, rays, hits);
  }
  cast_through_octree(map, rays, hits);
}

}  // namespace rayvox
