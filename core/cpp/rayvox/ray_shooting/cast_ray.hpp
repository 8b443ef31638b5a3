#pragma once
#include <cstddef>
#include <cstdint>

#include "rayvox/geometry/points_view.hpp"
#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/ray_scenes.hpp"

namespace rayvox {

enum class HitKind : std::uint8_t { nothing = 0, occupied = 1, unknown_entered = 2 };

/// Where the answers to a batch of rays are written (n each).
struct RayHits {
  std::uint8_t* kind;  // HitKind
  double* t_m;  // distance from the origin to where the ray enters the voxel; the ray's length where nothing was met
  std::int64_t* voxel;  // 3 each: finest-level cell entered; the last one where nothing was met
};

/// How the rays find what stops them; the answers are the same.
enum class RayEngine : std::uint8_t {
  automatic,  // masks, where they are there already or the rays are many enough to pay for them
  octree,     // strides through the octree's nodes
  masks,      // strides through the snapshot's StopMasks
  embree,     // an Embree scene of the snapshot's occupied leaves; unknown space stops nothing
};

struct RayBatch {
  PointsView origins_m, directions;  // as many of each; directions need not be normalised
  double max_range_m;                // 0: as far as the octree reaches
  bool unknown_stops;
};

/// For each ray the first occupied voxel or, if unknown space stops it, the first unknown one. The origin's own voxel
/// counts; beyond the octree all is unknown. Uses all cores. `scenes` belong to this snapshot. Throws InvalidInput for
/// a zero or non-finite direction or a bad range, OutOfRange for an origin outside the octree (the messages name the
/// ray), EngineUnavailable.
void cast_rays(const MapSnapshot& map, RayScenes& scenes, const RayBatch& rays, RayEngine engine, const RayHits& hits);

}  // namespace rayvox
