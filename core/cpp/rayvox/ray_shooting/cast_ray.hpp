#pragma once
#include <cstddef>
#include <cstdint>

#include "rayvox/geometry/points_view.hpp"
#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

enum class HitKind : std::uint8_t { nothing = 0, occupied = 1, unknown_entered = 2 };

/// Where the answers to a batch of rays are written (n each).
struct RayHits {
  std::uint8_t* kind;  // HitKind
  double* t_m;  // distance from the origin to where the ray enters the voxel; the ray's length where nothing was met
  std::int64_t* voxel;  // 3 each: finest-level cell entered; the last one where nothing was met
};

/// For each ray the first occupied voxel or, if unknown space stops it, the first unknown one. The origin's own voxel
/// counts. Directions need not be normalised. A max_range_m of 0 means as far as the octree reaches; beyond it all is
/// unknown. Uses all cores. Throws InvalidInput for a zero or non-finite direction or a bad range, OutOfRange for an
/// origin outside the octree; the messages name the ray.
void cast_rays(const MapSnapshot& map, PointsView origins_m, PointsView directions, double max_range_m,
               bool unknown_stops, const RayHits& hits);

/// The same answers, unknown space stopping nothing, through an Embree scene of the occupied leaves, made for this
/// batch; worth it from about as many rays as there are such leaves. False, with nothing written, if the map has more
/// than `most_leaves` of them or they lie too far apart. Throws EngineUnavailable besides.
bool cast_rays_by_embree(const MapSnapshot& map, PointsView origins_m, PointsView directions, double max_range_m,
                         std::size_t most_leaves, const RayHits& hits);

}  // namespace rayvox
