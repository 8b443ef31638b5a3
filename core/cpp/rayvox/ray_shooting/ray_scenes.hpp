#pragma once
#include <atomic>
#include <memory>
#include <mutex>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/occupied_scene.hpp"
#include "rayvox/ray_shooting/stop_masks.hpp"

namespace rayvox {

/// What the rays asked of one snapshot are shot through: each part is made when it is first asked for, by whichever
/// thread comes first while others wait, and then kept. Owned beside the snapshot by those who ask it more than once;
/// every call takes that same snapshot.
class RayScenes {
 public:
  const StopMasks& masks(const MapSnapshot& map, bool unknown_stops);
  bool has_masks(bool unknown_stops) const { return masks_[unknown_stops].ready.load(std::memory_order_acquire); }
  /// Null if float32 cannot hold the occupied leaves apart. Throws EngineUnavailable.
  const OccupiedScene* occupied(const MapSnapshot& map);

 private:
  template <class Scene>
  struct Slot {
    std::once_flag once;
    std::unique_ptr<const Scene> scene;
    std::atomic<bool> ready = false;
  };

  Slot<StopMasks> masks_[2];
  Slot<OccupiedScene> occupied_;
};

}  // namespace rayvox
