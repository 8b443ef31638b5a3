#include "rayvox/occupancy_map.hpp"

#include "rayvox/octree/clear_box.hpp"

namespace rayvox {

MapSnapshot OccupancyMap::snapshot() const {
  std::lock_guard lock(mutex_);
  return map_;
}

std::uint64_t OccupancyMap::revision() const {
  std::lock_guard lock(mutex_);
  return map_.revision;
}

OccupancyMap::Insertion OccupancyMap::insert(const ScanRays& rays, Engine engine) {
  std::lock_guard lock(mutex_);
  if (engine == Engine::embree) EmbreeLibrary::get();
  ++map_.revision;
  const ScanStatistics statistics = insert_rays(map_, rays, engine, regions_);
  return {map_.revision, statistics};
}

void OccupancyMap::discard() {
  std::lock_guard lock(mutex_);
  map_.root = Child();
  regions_.reset();
}

std::uint64_t OccupancyMap::clear_box(const Vec3d& low_m, const Vec3d& high_m) {
  const CellBox box = cells_touching(map_.geometry, low_m, high_m, "clear_box");
  std::lock_guard lock(mutex_);
  ++map_.revision;
  clear_cells(map_, box);
  return map_.revision;
}

}  // namespace rayvox
