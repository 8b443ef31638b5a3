#include "rayvox/ray_shooting/ray_scenes.hpp"

#include <utility>

namespace rayvox {

const StopMasks& RayScenes::masks(const MapSnapshot& map, bool unknown_stops) {
  Slot<StopMasks>& slot = masks_[unknown_stops];
  std::call_once(slot.once, [&] {
    slot.scene = std::make_unique<StopMasks>(map, unknown_stops);
    slot.ready.store(true, std::memory_order_release);
  });
  return *slot.scene;
}

const OccupiedScene* RayScenes::occupied(const MapSnapshot& map) {
  std::call_once(occupied_.once, [&] {
    if (auto made = OccupiedScene::of(map, EmbreeLibrary::get())) {
      occupied_.scene = std::make_unique<OccupiedScene>(std::move(*made));
    }
  });
  return occupied_.scene.get();
}

}  // namespace rayvox
