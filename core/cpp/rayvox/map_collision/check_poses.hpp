#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "rayvox/collision/collide.hpp"
#include "rayvox/map_collision/link_body.hpp"
#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/parallel/cancellation.hpp"

namespace rayvox {

enum class MapVerdict : std::uint8_t { free = 0, occupied = 1, unknown = 2 };

/// A voxel that a link touches or encloses; log-odds NaN where it is unknown. It has 2^level cells a side from `first`
/// on, a leaf of the pruned octree.
struct VoxelContact {
  std::uint32_t pose, link;
  Cell first;
  int level;
  float log_odds;
};

struct MapCheckOptions {
  bool unknown_is_occupied = false;
  float occupied_log_odds = 0;                  // a voxel with at least these is occupied
  std::span<const double> more_padding_m = {};  // per pose and link, on top of the links' own; empty for none
  Contacts contacts = Contacts::none;
  const CollisionKernels* kernels = nullptr;        // null: the best this processor runs
  const CancellationToken* cancellation = nullptr;  // asked every few poses
};

struct MapCheckResult {
  std::vector<std::uint8_t> verdict;   // per pose, MapVerdict
  std::vector<VoxelContact> contacts;  // by pose, link and octree order; first: one a pose, an occupied one if there is
};

/// A rigid part of a robot, and by how much it is grown: a voxel collides if it does when grown by as much on all
/// sides.
struct MapCheckLink {
  const LinkBody* body = nullptr;  // null for a link without geometry
  double padding_m = 0;
};

/// Whether the links, placed by `T_map_links` (row-major 4x4, one per link, pose after pose), touch or enclose occupied
/// voxels or, if they count, unknown ones. All voxels are closed cubes; what lies beyond the octree is unknown. A pose
/// that meets both is `occupied`. No collision is missed; a voxel within some 1e-14 of the sizes involved may count as
/// touched. All threads. Throws InvalidInput for a pose that is not rigid, naming its index and link, and
/// for paddings that are not finite and at least 0; Cancelled when told to.
MapCheckResult check_poses(const MapSnapshot& map, std::span<const MapCheckLink> links,
                           std::span<const double> T_map_links, const MapCheckOptions& options);

}  // namespace rayvox
