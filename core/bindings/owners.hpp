#pragma once
// Python's owners of maps and snapshots. Freeing millions of nodes takes a while; they let other Python threads run
// meanwhile.
#include <nanobind/nanobind.h>

#include <memory>
#include <utility>

#include "rayvox/occupancy_map.hpp"
#include "rayvox/ray_shooting/ray_scenes.hpp"

namespace rayvox::bindings {

struct OwnedSnapshot : MapSnapshot {
  explicit OwnedSnapshot(MapSnapshot snapshot)
      : MapSnapshot(std::move(snapshot)), scenes(std::make_unique<RayScenes>()) {}
  OwnedSnapshot(OwnedSnapshot&&) = default;
  ~OwnedSnapshot() {
    if (root.is_unknown()) return;
    nanobind::gil_scoped_release release;
    scenes.reset();
    root = Child();
  }

  std::unique_ptr<RayScenes> scenes;  // kept with the snapshot they are made from
};

struct OwnedMap : OccupancyMap {
  using OccupancyMap::OccupancyMap;
  ~OwnedMap() {
    nanobind::gil_scoped_release release;
    discard();
  }
};

}  // namespace rayvox::bindings
