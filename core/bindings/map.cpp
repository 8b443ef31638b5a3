#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "arrays.hpp"
#include "owners.hpp"

namespace rayvox::bindings {
namespace {

using Release = nb::gil_scoped_release;

Vec3d vec3(const nb::tuple& t) { return {nb::cast<double>(t[0]), nb::cast<double>(t[1]), nb::cast<double>(t[2])}; }

template <class Points>
ScanRays prepare(const OwnedMap& map, const Points& points, const std::optional<Matrix4>& T_map_sensor,
                 const nb::tuple& origin, double max_range_m, const std::optional<Points64>& no_return,
                 bool discretize) {
  Scan scan{.points_sensor = view(points),
            .no_return_sensor = no_return ? view(*no_return) : PointsView{},
            .T_map_sensor = T_map_sensor ? RigidTransform::from_matrix(T_map_sensor->data()) : RigidTransform(),
            .origin_sensor_m = vec3(origin),
            .max_range_m = max_range_m,
            .discretize = discretize};
  Release release;
  return prepare_scan(scan, map.geometry());
}

nb::tuple insert(OwnedMap& map, const ScanRays& rays, Engine engine) {
  OccupancyMap::Insertion insertion;
  {
    Release release;
    insertion = map.insert(rays, engine);
  }
  return nb::make_tuple(insertion.revision, insertion.statistics);
}

}  // namespace

void bind_map(nb::module_& m) {
  nb::enum_<Engine>(m, "Engine")
      .value("auto", Engine::automatic)
      .value("dda", Engine::dda)
      .value("beam", Engine::beam)
      .value("embree", Engine::embree);
  m.def("load_embree", &EmbreeLibrary::load, nb::arg("paths"));
  m.def("embree_version", [] { return EmbreeLibrary::get().version(); });

  nb::class_<ScanStatistics>(m, "ScanStatistics")
      .def_ro("engine", &ScanStatistics::engine)
      .def_ro("ray_count", &ScanStatistics::ray_count)
      .def_ro("voxel_steps", &ScanStatistics::voxel_steps)
      .def_ro("tile_count", &ScanStatistics::tile_count)
      .def_ro("brick_count", &ScanStatistics::brick_count)
      .def_ro("voxels_changed", &ScanStatistics::voxels_changed)
      .def_ro("bvh_node_count", &ScanStatistics::bvh_node_count)
      .def_ro("bvh_s", &ScanStatistics::bvh_s)
      .def_ro("cut_s", &ScanStatistics::cut_s)
      .def_ro("shoot_s", &ScanStatistics::shoot_s)
      .def_ro("update_s", &ScanStatistics::update_s)
      .def_ro("total_s", &ScanStatistics::total_s);

  nb::class_<ScanRays>(m, "PreparedScan")
      .def_prop_ro("ray_count", &ScanRays::count)
      .def_prop_ro("nbytes", &ScanRays::bytes);

  nb::class_<OwnedMap>(m, "OccupancyMap")
      .def(
          "__init__",
          [](OwnedMap* self, double resolution_m, int depth, const SensorModel& model) {
            new (self) OwnedMap(MapGeometry(resolution_m, depth), model);
          },
          nb::arg("resolution_m"), nb::arg("depth"), nb::arg("sensor_model"))
      .def(
          "__init__", [](OwnedMap* self, const OwnedSnapshot& snapshot) { new (self) OwnedMap(snapshot); },
          nb::arg("snapshot"))
      .def_prop_ro(
          "revision", [](const OwnedMap& map) { return map.revision(); }, nb::call_guard<Release>())
      .def(
          "snapshot", [](const OwnedMap& map) { return OwnedSnapshot(map.snapshot()); }, nb::call_guard<Release>())
      .def("prepare", &prepare<Points32>, nb::arg("points"), nb::arg("T_map_sensor").none(), nb::arg("origin"),
           nb::arg("max_range_m"), nb::arg("no_return").none(), nb::arg("discretize"),
           nb::sig("def prepare(self, points: NDArray[numpy.float32], T_map_sensor: NDArray[numpy.float64] | None, "
                   "origin: tuple[float, float, float], max_range_m: float, no_return: NDArray[numpy.float64] | None, "
                   "discretize: bool) -> PreparedScan"))
      .def("prepare", &prepare<Points64>, nb::arg("points"), nb::arg("T_map_sensor").none(), nb::arg("origin"),
           nb::arg("max_range_m"), nb::arg("no_return").none(), nb::arg("discretize"),
           nb::sig("def prepare(self, points: NDArray[numpy.float64], T_map_sensor: NDArray[numpy.float64] | None, "
                   "origin: tuple[float, float, float], max_range_m: float, no_return: NDArray[numpy.float64] | None, "
                   "discretize: bool) -> PreparedScan"))
      .def("insert", &insert, nb::arg("scan"), nb::arg("engine"),
           nb::sig("def insert(self, scan: PreparedScan, engine: Engine) -> tuple[int, ScanStatistics]"))
      .def(
          "clear_box",
          [](OwnedMap& map, const nb::tuple& low_m, const nb::tuple& high_m) {
            const Vec3d low = vec3(low_m), high = vec3(high_m);
            Release release;
            return map.clear_box(low, high);
          },
          nb::arg("low_m"), nb::arg("high_m"),
          nb::sig("def clear_box(self, low_m: tuple[float, float, float], high_m: tuple[float, float, float]) -> int"));
}

}  // namespace rayvox::bindings
