#pragma once
#include "rayvox/map_collision/check_poses.hpp"

namespace rayvox {

/// Farther than any map or mesh reaches, and near enough for float32 to square.
constexpr double farthest_clearance_m = 1e15;

struct ClearanceOptions {
  bool unknown_is_occupied = false;
  float occupied_log_odds = 0;                      // a voxel with at least these is occupied
  double max_clearance_m = farthest_clearance_m;    // at most that, even if more is asked for
  const CollisionKernels* kernels = nullptr;        // null: the best this processor runs
  const CancellationToken* cancellation = nullptr;  // asked at every pose
};

/// How far a robot at one pose is from the nearest voxel that counts.
struct PoseClearance {
  MapVerdict verdict = MapVerdict::free;
  /// 0 unless the verdict is free; max_clearance_m where nothing is nearer. Never more than the true distance.
  double clearance_m = 0;
  bool is_lower_bound = false;
  // What is nearest, if free and not cut off:
  std::int32_t link = -1;
  Vec3d point_m;    // on the link's surface, map frame
  Vec3d direction;  // from there to the voxel, unit length, map frame
  int level = -1;   // the voxel has 2^level cells a side from `first` on; -1: it is the border of the octree
  Cell first{};
};

/// Clearances of a robot whose links are placed as for check_poses, which says what collides. A padded link is as far
/// from a voxel as from that voxel grown by the padding on all sides, at most as far as if the link itself were grown.
/// Distances are exact: each comes from one triangle and one voxel, in float64, and is rounded down
/// (triangle_cube_distance.hpp). All threads. Throws InvalidInput as check_poses, and unless max_clearance_m is above
/// 0.
std::vector<PoseClearance> measure_clearances(const MapSnapshot& map, std::span<const MapCheckLink> links,
                                              std::span<const double> T_map_links, const ClearanceOptions& options);

}  // namespace rayvox
