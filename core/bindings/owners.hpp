#pragma once
// Python's owners of maps and snapshots. Freeing millions of nodes takes a while; they let other Python threads run
// meanwhile.
#include <nanobind/nanobind.h>

#include <utility>

#include "rayvox/occupancy_map.hpp"

namespace rayvox::bindings {

struct OwnedSnapshot : MapSnapshot {
  explicit OwnedSnapshot(MapSnapshot snapshot) : MapSnapshot(std::move(snapshot)) {}
  OwnedSnapshot(OwnedSnapshot&&) = default;
  ~OwnedSnapshot() {
    if (root.is_unknown()) return;
    nanobind::gil_scoped_release release;
    root = Child();
  }
};

struct OwnedMap : OccupancyMap {
  using OccupancyMap::OccupancyMap;
  ~OwnedMap() {
    nanobind::gil_scoped_release release;
    discard();
  }
};

}  // namespace rayvox::bindings
