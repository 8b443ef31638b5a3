#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "arrays.hpp"
#include "named.hpp"
#include "owners.hpp"
#include "rayvox/error.hpp"
#include "rayvox/map_collision/check_poses.hpp"
#include "rayvox/map_collision/clearance.hpp"

namespace rayvox::bindings {
namespace {

using Release = nb::gil_scoped_release;
using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using LinkPoses = nb::ndarray<const double, nb::shape<-1, -1, 4, 4>, nb::c_contig, nb::device::cpu>;

nb::tuple contact_arrays(const std::vector<VoxelContact>& contacts) {
  NewArray<std::int64_t, 6> rows(contacts.size());
  NewArray<float> log_odds(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const VoxelContact& contact = contacts[i];
    const std::int64_t row[] = {contact.pose,     contact.link,     contact.first[0],
                                contact.first[1], contact.first[2], contact.level};
    std::copy_n(row, 6, rows.data() + 6 * i);
    log_odds.data()[i] = contact.log_odds;
  }
  return nb::make_tuple(rows.release(), log_odds.release());
}

std::vector<MapCheckLink> check_links(const std::vector<const LinkBody*>& bodies, const std::vector<double>& paddings_m,
                                      const LinkPoses& T_map_links) {
  if (paddings_m.size() != bodies.size() || T_map_links.shape(1) != bodies.size()) {
    throw InvalidInput("a check needs one padding and one pose per link");
  }
  std::vector<MapCheckLink> links;
  for (std::size_t i = 0; i < bodies.size(); ++i) links.push_back({bodies[i], paddings_m[i]});
  return links;
}

nb::tuple check(const OwnedSnapshot& map, const std::vector<const LinkBody*>& bodies,
                const std::vector<double>& paddings_m, const LinkPoses& T_map_links, bool unknown_is_occupied,
                float occupied_log_odds, const std::string& contacts, const std::optional<Rows>& more_padding_m,
                const CancellationToken* cancellation) {
  const std::vector<MapCheckLink> links = check_links(bodies, paddings_m, T_map_links);
  MapCheckOptions options{unknown_is_occupied, occupied_log_odds, {}, contacts_named(contacts)};
  options.cancellation = cancellation;
  if (more_padding_m) options.more_padding_m = {more_padding_m->data(), more_padding_m->size()};
  MapCheckResult result;
  {
    Release release;
    result = check_poses(map, links, {T_map_links.data(), 16 * bodies.size() * T_map_links.shape(0)}, options);
  }
  NewArray<std::uint8_t> verdict(result.verdict.size());
  std::copy(result.verdict.begin(), result.verdict.end(), verdict.data());
  const nb::tuple found = contact_arrays(result.contacts);
  return nb::make_tuple(verdict.release(), found[0], found[1]);
}

nb::tuple clearance_arrays(const std::vector<PoseClearance>& clearances) {
  const std::size_t count = clearances.size();
  NewArray<std::uint8_t> verdict(count), is_lower_bound(count);
  NewArray<double, 7> metres(count);
  NewArray<std::int64_t, 5> voxel(count);
  for (std::size_t i = 0; i < count; ++i) {
    const PoseClearance& at = clearances[i];
    verdict.data()[i] = static_cast<std::uint8_t>(at.verdict);
    is_lower_bound.data()[i] = at.is_lower_bound;
    const double row[] = {at.clearance_m, at.direction.x, at.direction.y, at.direction.z,
                          at.point_m.x,   at.point_m.y,   at.point_m.z};
    std::copy_n(row, 7, metres.data() + 7 * i);
    const std::int64_t cells[] = {at.link, at.first[0], at.first[1], at.first[2], at.level};
    std::copy_n(cells, 5, voxel.data() + 5 * i);
  }
  return nb::make_tuple(verdict.release(), is_lower_bound.release(), metres.release(), voxel.release());
}

nb::tuple clearances(const OwnedSnapshot& map, const std::vector<const LinkBody*>& bodies,
                     const std::vector<double>& paddings_m, const LinkPoses& T_map_links, bool unknown_is_occupied,
                     float occupied_log_odds, double max_clearance_m, const CancellationToken* cancellation) {
  const std::vector<MapCheckLink> links = check_links(bodies, paddings_m, T_map_links);
  std::vector<PoseClearance> found;
  {
    Release release;
    found = measure_clearances(map, links, {T_map_links.data(), 16 * bodies.size() * T_map_links.shape(0)},
                               {unknown_is_occupied, occupied_log_odds, max_clearance_m, nullptr, cancellation});
  }
  return clearance_arrays(found);
}

}  // namespace

void bind_map_collision(nb::module_& m) {
  nb::class_<CancellationToken>(m, "CancellationToken",
                                "Tells a query in another thread that nobody waits for its answer any more.")
      .def(nb::init<>())
      .def("cancel", &CancellationToken::cancel, "The query raises QueryCancelledError soon; for good.")
      .def_prop_ro("cancelled", &CancellationToken::cancelled);
  nb::class_<LinkBody>(m, "LinkBody")
      .def(
          "__init__",
          [](LinkBody* self, std::shared_ptr<KdopBvh> bvh) {
            Release release;
            new (self) LinkBody(std::move(bvh));
          },
          nb::arg("bvh"))
      .def(
          "__init__",
          [](LinkBody* self, std::shared_ptr<KdopBvh> surface, const LinkBody& detailed) {
            Release release;
            new (self) LinkBody(std::move(surface), detailed);
          },
          nb::arg("surface"), nb::arg("detailed"))
      .def_prop_ro("triangle_count", [](const LinkBody& body) { return body.mesh().triangle_count(); });
  m.def("check_poses", &check, nb::arg("map"), nb::arg("bodies"), nb::arg("paddings_m"), nb::arg("T_map_links"),
        nb::arg("unknown_is_occupied"), nb::arg("occupied_log_odds"), nb::arg("contacts"),
        nb::arg("more_padding_m").none() = nb::none(), nb::arg("cancellation").none() = nb::none(),
        nb::sig("def check_poses(map: MapSnapshot, bodies: list[LinkBody | None], paddings_m: list[float], "
                "T_map_links: NDArray[numpy.float64], unknown_is_occupied: bool, occupied_log_odds: float, "
                "contacts: str, more_padding_m: NDArray[numpy.float64] | None = None, "
                "cancellation: CancellationToken | None = None) -> tuple[NDArray[numpy.uint8], "
                "NDArray[numpy.int64], NDArray[numpy.float32]]"));
  m.def("measure_clearances", &clearances, nb::arg("map"), nb::arg("bodies"), nb::arg("paddings_m"),
        nb::arg("T_map_links"), nb::arg("unknown_is_occupied"), nb::arg("occupied_log_odds"),
        nb::arg("max_clearance_m"), nb::arg("cancellation").none() = nb::none(),
        nb::sig("def measure_clearances(map: MapSnapshot, bodies: list[LinkBody | None], paddings_m: list[float], "
                "T_map_links: NDArray[numpy.float64], unknown_is_occupied: bool, occupied_log_odds: float, "
                "max_clearance_m: float, cancellation: CancellationToken | None = None) -> tuple[NDArray[numpy.uint8], "
                "NDArray[numpy.uint8], NDArray[numpy.float64], "
                "NDArray[numpy.int64]]"));
}

}  // namespace rayvox::bindings
