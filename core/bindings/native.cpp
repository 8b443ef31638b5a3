#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "rayvox/error.hpp"
#include "rayvox/octree/sensor_model.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/simd/kernels.hpp"

namespace nb = nanobind;

namespace rayvox::bindings {

void bind_snapshot(nb::module_& m);
void bind_map(nb::module_& m);
void bind_robot(nb::module_& m);
void bind_collision(nb::module_& m);
void bind_map_collision(nb::module_& m);

namespace {

// Kernel exceptions become the classes of rayvox.errors, so that Python has one tree.
void raise(const char* name, const std::exception& error) {
  const nb::object type = nb::module_::import_("rayvox.errors").attr(name);
  PyErr_SetString(type.ptr(), error.what());
}

void translate(const std::exception_ptr& pointer, void*) {
  try {
    std::rethrow_exception(pointer);
  } catch (const OutOfRange& error) {
    raise("OutOfRangeError", error);
  } catch (const InvalidInput& error) {
    raise("InvalidInputError", error);
  } catch (const MapFormatError& error) {
    raise("MapFormatError", error);
  } catch (const EngineUnavailable& error) {
    raise("EngineUnavailableError", error);
  } catch (const Cancelled& error) {
    raise("QueryCancelledError", error);
  }
}

}  // namespace

NB_MODULE(_native, m) {
  // Maps that live until the interpreter ends are no leak worth a warning in every user's terminal.
  nb::set_leak_warnings(false);
  nb::register_exception_translator(translate);
  nb::class_<SensorModel>(m, "SensorModel")
      .def(nb::init<double, double, double, double, double>(), nb::arg("p_hit"), nb::arg("p_miss"),
           nb::arg("p_clamp_min"), nb::arg("p_clamp_max"), nb::arg("p_occupied"))
      .def_ro("hit_log_odds", &SensorModel::hit_log_odds)
      .def_ro("miss_log_odds", &SensorModel::miss_log_odds)
      .def_ro("clamp_min_log_odds", &SensorModel::clamp_min_log_odds)
      .def_ro("clamp_max_log_odds", &SensorModel::clamp_max_log_odds)
      .def_ro("occupied_log_odds", &SensorModel::occupied_log_odds);
  bind_snapshot(m);
  bind_map(m);
  bind_robot(m);
  bind_collision(m);
  bind_map_collision(m);
  m.def("thread_count", &thread_count);
  m.def("set_thread_count", &set_thread_count, nb::arg("count"));
  m.def("instruction_set", [] { return kernels().instruction_set; });
}

}  // namespace rayvox::bindings
