#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "arrays.hpp"
#include "owners.hpp"
#include "rayvox/octree/change_set.hpp"
#include "rayvox/octree/leaves.hpp"
#include "rayvox/octree/map_statistics.hpp"
#include "rayvox/octree/node_stream.hpp"
#include "rayvox/octree/octomap_file.hpp"
#include "rayvox/octree/queries.hpp"
#include "rayvox/ray_shooting/cast_ray.hpp"

namespace rayvox::bindings {
namespace {

using Release = nb::gil_scoped_release;

nb::bytes as_bytes(const std::string& text) { return nb::bytes(text.data(), text.size()); }

nb::tuple read_out(const LeafReadout& readout) {
  NewArray<std::int64_t, 3> keys(readout.count());
  NewArray<std::uint8_t> depth(readout.count());
  NewArray<float> log_odds(readout.count());
  {
    Release release;
    readout.write({keys.data(), depth.data(), log_odds.data()});
  }
  return nb::make_tuple(keys.release(), depth.release(), log_odds.release());
}

nb::tuple leaves(const OwnedSnapshot& map) {
  std::optional<LeafReadout> readout;
  {
    Release release;
    readout.emplace(map);
  }
  return read_out(*readout);
}

nb::tuple leaves_in(const OwnedSnapshot& map, nb::tuple low_m, nb::tuple high_m) {
  const auto vec = [](const nb::tuple& t) {
    return Vec3d{nb::cast<double>(t[0]), nb::cast<double>(t[1]), nb::cast<double>(t[2])};
  };
  const LeafList list = leaves_in_box(map, cells_touching(map.geometry, vec(low_m), vec(high_m), "leaves_in_box"));
  NewArray<std::int64_t, 3> keys(list.depth.size());
  NewArray<std::uint8_t> depth(list.depth.size());
  NewArray<float> log_odds(list.depth.size());
  std::copy(list.keys.begin(), list.keys.end(), keys.data());
  std::copy(list.depth.begin(), list.depth.end(), depth.data());
  std::copy(list.log_odds.begin(), list.log_odds.end(), log_odds.data());
  return nb::make_tuple(keys.release(), depth.release(), log_odds.release());
}

nb::tuple changes(const OwnedSnapshot& map, std::uint64_t since) {
  const ChangedRegions changed = changed_regions(map, since);
  NewArray<std::int64_t, 3> keys(changed.regions.size());
  NewArray<std::uint8_t> depth(changed.regions.size());
  for (std::size_t i = 0; i < changed.regions.size(); ++i) {
    std::copy(changed.regions[i].first.begin(), changed.regions[i].first.end(), keys.data() + 3 * i);
    depth.data()[i] = static_cast<std::uint8_t>(map.geometry.depth() - changed.regions[i].level);
  }
  return nb::make_tuple(changed.full, keys.release(), depth.release(), read_out(LeafReadout(map, changed.regions)));
}

nb::tuple cast(const OwnedSnapshot& map, const Points64& origins, const Points64& directions, double max_range_m,
               bool unknown_stops, RayEngine engine) {
  NewArray<std::uint8_t> kind(origins.shape(0));
  NewArray<double> t_m(origins.shape(0));
  NewArray<std::int64_t, 3> voxel(origins.shape(0));
  {
    Release release;
    cast_rays(map, *map.scenes, {view(origins), view(directions), max_range_m, unknown_stops}, engine,
              {kind.data(), t_m.data(), voxel.data()});
  }
  return nb::make_tuple(kind.release(), t_m.release(), voxel.release());
}

template <class Points>
nb::object log_odds(const OwnedSnapshot& map, const Points& points, int level) {
  NewArray<float> out(points.shape(0));
  {
    Release release;
    log_odds_at(map, view(points), level, out.data());
  }
  return out.release();
}

template <class Points>
nb::object states(const OwnedSnapshot& map, const Points& points, int level) {
  NewArray<std::uint8_t> out(points.shape(0));
  {
    Release release;
    states_at(map, view(points), level, out.data());
  }
  return out.release();
}

nb::object box_states(const OwnedSnapshot& map, const Points64& low, const Points64& high) {
  NewArray<std::uint8_t> out(low.shape(0));
  {
    Release release;
    states_of_boxes(map, view(low), view(high), out.data());
  }
  return out.release();
}

nb::dict statistics(const OwnedSnapshot& map) {
  MapStatistics s;
  {
    Release release;
    s = statistics_of(map);
  }
  const double cell_m3 = map.geometry.resolution_m() * map.geometry.resolution_m() * map.geometry.resolution_m();
  nb::dict out;
  out["occupied_leaves"] = s.occupied_leaves;
  out["free_leaves"] = s.free_leaves;
  out["nodes"] = s.nodes;
  out["occupied_volume_m3"] = static_cast<double>(s.occupied_cells) * cell_m3;
  out["free_volume_m3"] = static_cast<double>(s.free_cells) * cell_m3;
  out["nbytes"] = memory_bytes(map);
  out["low_cell"] = nb::make_tuple(s.known.low[0], s.known.low[1], s.known.low[2]);
  out["high_cell"] = nb::make_tuple(s.known.high[0], s.known.high[1], s.known.high[2]);
  return out;
}

template <std::string (*write)(const MapSnapshot&)>
nb::bytes written(const OwnedSnapshot& map) {
  std::string bytes;
  {
    Release release;
    bytes = write(map);
  }
  return as_bytes(bytes);
}

OwnedSnapshot from_octomap(const nb::bytes& bytes, const SensorModel& model) {
  const std::span<const char> view(bytes.c_str(), bytes.size());
  Release release;
  return OwnedSnapshot(read_octomap(view, model));
}

OwnedSnapshot from_nodes(const nb::bytes& bytes, double resolution_m, int depth, const SensorModel& model,
                         std::uint64_t revision) {
  const std::span<const char> view(bytes.c_str(), bytes.size());
  Release release;
  return OwnedSnapshot(
      {MapGeometry(resolution_m, depth), model, read_nodes(view, depth), revision, revision, revision});
}

}  // namespace

// Return types for the stub, which cannot see into tuples and objects.
#define RAYVOX_LEAVES "tuple[NDArray[numpy.int64], NDArray[numpy.uint8], NDArray[numpy.float32]]"

void bind_snapshot(nb::module_& m) {
  nb::enum_<RayEngine>(m, "RayEngine")
      .value("auto", RayEngine::automatic)
      .value("octree", RayEngine::octree)
      .value("masks", RayEngine::masks)
      .value("embree", RayEngine::embree);
  nb::class_<OwnedSnapshot>(m, "MapSnapshot")
      .def_prop_ro("resolution_m", [](const OwnedSnapshot& map) { return map.geometry.resolution_m(); })
      .def_prop_ro("depth", [](const OwnedSnapshot& map) { return map.geometry.depth(); })
      .def_prop_ro("revision", [](const OwnedSnapshot& map) { return map.revision; })
      .def_prop_ro("nbytes", [](const OwnedSnapshot& map) { return memory_bytes(map); })
      .def("leaves", &leaves, nb::sig("def leaves(self) -> " RAYVOX_LEAVES))
      .def("leaves_in_box", &leaves_in, nb::arg("low_m"), nb::arg("high_m"),
           nb::sig("def leaves_in_box(self, low_m: tuple[float, float, float], high_m: tuple[float, float, float]) "
                   "-> " RAYVOX_LEAVES))
      .def("changes", &changes, nb::arg("since"),
           nb::sig(
               "def changes(self, since: int) -> tuple[bool, NDArray[numpy.int64], NDArray[numpy.uint8], " RAYVOX_LEAVES
               "]"))
      .def("log_odds_at", &log_odds<Points32>, nb::arg("points"), nb::arg("level"),
           nb::sig("def log_odds_at(self, points: NDArray[numpy.float32], level: int) -> NDArray[numpy.float32]"))
      .def("log_odds_at", &log_odds<Points64>, nb::arg("points"), nb::arg("level"),
           nb::sig("def log_odds_at(self, points: NDArray[numpy.float64], level: int) -> NDArray[numpy.float32]"))
      .def("states_at", &states<Points32>, nb::arg("points"), nb::arg("level"),
           nb::sig("def states_at(self, points: NDArray[numpy.float32], level: int) -> NDArray[numpy.uint8]"))
      .def("states_at", &states<Points64>, nb::arg("points"), nb::arg("level"),
           nb::sig("def states_at(self, points: NDArray[numpy.float64], level: int) -> NDArray[numpy.uint8]"))
      .def("box_states", &box_states, nb::arg("low_m"), nb::arg("high_m"),
           nb::sig("def box_states(self, low_m: NDArray[numpy.float64], high_m: NDArray[numpy.float64]) -> "
                   "NDArray[numpy.uint8]"))
      .def("cast_rays", &cast, nb::arg("origins"), nb::arg("directions"), nb::arg("max_range_m"),
           nb::arg("unknown_stops"), nb::arg("engine"),
           nb::sig("def cast_rays(self, origins: NDArray[numpy.float64], directions: NDArray[numpy.float64], "
                   "max_range_m: float, unknown_stops: bool, engine: RayEngine) -> "
                   "tuple[NDArray[numpy.uint8], NDArray[numpy.float64], NDArray[numpy.int64]]"))
      .def("statistics", &statistics, nb::sig("def statistics(self) -> dict[str, Any]"))
      .def("to_nodes", &written<write_nodes>)
      .def("to_bt", &written<to_bt>)
      .def("to_ot", &written<to_ot>)
      .def("to_ply", &written<to_ply>);
  m.def("read_octomap", &from_octomap, nb::arg("data"), nb::arg("sensor_model"));
  m.def("read_nodes", &from_nodes, nb::arg("data"), nb::arg("resolution_m"), nb::arg("depth"), nb::arg("sensor_model"),
        nb::arg("revision"));
}

}  // namespace rayvox::bindings
