#pragma once
#include <cstdint>
#include <memory>
#include <mutex>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/scan_insertion.hpp"

namespace rayvox {

/// A probabilistic occupancy octree that grows by scans. Writers are serialised; readers take snapshots and never wait
/// longer than one insertion.
class OccupancyMap {
 public:
  OccupancyMap(MapGeometry geometry, SensorModel model) : map_{geometry, model, {}, 0, 0, 0} {}
  /// Goes on from a state that was read from a file.
  explicit OccupancyMap(MapSnapshot state) : map_(std::move(state)) {}

  const MapGeometry& geometry() const { return map_.geometry; }
  const SensorModel& model() const { return map_.model; }
  MapSnapshot snapshot() const;
  std::uint64_t revision() const;

  struct Insertion {
    std::uint64_t revision;
    ScanStatistics statistics;
  };
  /// Applies a prepared scan; each insertion is one revision. Throws EngineUnavailable, with the map unchanged.
  Insertion insert(const ScanRays& rays, Engine engine = Engine::automatic);
  /// Makes every voxel that touches the closed box (metres) unknown; returns the new revision. Throws InvalidInput for
  /// bounds that are not finite or not in order.
  std::uint64_t clear_box(const Vec3d& low_m, const Vec3d& high_m);
  /// Drops all nodes; for owners that want the time this takes spent before their destructor runs.
  void discard();

 private:
  mutable std::mutex mutex_;
  MapSnapshot map_;
  std::unique_ptr<EmbreeRegions> regions_;
};

}  // namespace rayvox
