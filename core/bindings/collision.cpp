#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "named.hpp"
#include "rayvox/collision/collide.hpp"
#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/collision/self_collision.hpp"
#include "rayvox/error.hpp"

namespace rayvox::bindings {
namespace {

using Release = nb::gil_scoped_release;
using Indices3 = nb::ndarray<const std::int64_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using IndexPairs = nb::ndarray<const std::int64_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using LinkPoses = nb::ndarray<const double, nb::shape<-1, -1, 4, 4>, nb::c_contig, nb::device::cpu>;
using Matrices4 = nb::ndarray<const double, nb::shape<-1, 4, 4>, nb::c_contig, nb::device::cpu>;

Construction construction_named(const std::string& name) {
  return by_name<Construction>(name, "construction",
                               {{"bng", Construction::batch_neural_gas},
                                {"longest_axis", Construction::longest_axis},
                                {"extended_longest_axis", Construction::extended_longest_axis},
                                {"sah", Construction::surface_area_heuristic}});
}

Traversal traversal_named(const std::string& name) {
  return by_name<Traversal>(name, "traversal",
                            {{"hybrid", Traversal::hybrid},
                             {"4vs4", Traversal::four_vs_four},
                             {"1vs16", Traversal::one_vs_sixteen},
                             {"simd_binary", Traversal::simd_orientations},
                             {"binary", Traversal::scalar}});
}

SlabFormat slabs_named(const std::string& name) {
  return by_name<SlabFormat>(name, "slabs", {{"float16", SlabFormat::float16}, {"float32", SlabFormat::float32}});
}

std::shared_ptr<KdopBvh> build(const std::shared_ptr<CollisionMesh>& mesh, int k, const std::optional<Points64>& axes,
                               int branching_factor, const std::string& construction, const std::string& slabs,
                               const std::string& traversal, int leaf_size, std::uint64_t seed) {
  BvhOptions options{.axes = KdopAxes::standard(axes ? 6 : k),
                     .branching_factor = branching_factor,
                     .construction = construction_named(construction),
                     .slabs = slabs_named(slabs),
                     .traversal = traversal_named(traversal),
                     .leaf_size = leaf_size,
                     .seed = seed};
  if (axes) {
    std::vector<Vec3d> given;
    for (std::size_t i = 0; i < axes->shape(0); ++i) given.push_back(view(*axes)[i]);
    options.axes = KdopAxes(std::move(given));
  }
  Release release;
  return std::make_shared<KdopBvh>(mesh, options);
}

nb::object contact_rows(const CollideResult& result) {
  NewArray<std::int64_t, 3> rows(result.contacts.size());
  for (std::size_t i = 0; i < result.contacts.size(); ++i) {
    const Contact& contact = result.contacts[i];
    rows.data()[3 * i] = contact.pose;
    rows.data()[3 * i + 1] = contact.triangle_a;
    rows.data()[3 * i + 2] = contact.triangle_b;
  }
  return rows.release();
}

nb::object statistics_rows(const CollideResult& result) {
  NewArray<std::int64_t, 4> rows(result.statistics.size());
  for (std::size_t i = 0; i < result.statistics.size(); ++i) {
    const TraversalCounts& counts = result.statistics[i];
    const std::uint64_t values[] = {counts.node_pairs, counts.axis_tests, counts.triangle_pairs, counts.undecided};
    for (std::size_t j = 0; j < 4; ++j) rows.data()[4 * i + j] = static_cast<std::int64_t>(values[j]);
  }
  return rows.release();
}

nb::tuple collide_poses(const KdopBvh& a, const KdopBvh& b, const Matrices4& T_a_b, const std::string& contacts,
                        bool solids, bool statistics) {
  const CollideOptions options{contacts_named(contacts), solids, statistics};
  CollideResult result;
  {
    Release release;
    result = collide(a, b, {T_a_b.data(), 16 * T_a_b.shape(0)}, options);
  }
  NewArray<std::uint8_t> state(result.state.size());
  std::copy(result.state.begin(), result.state.end(), state.data());
  return nb::make_tuple(state.release(), contact_rows(result), statistics_rows(result));
}

std::vector<SelfCollision::LinkPair> link_pairs(const IndexPairs& pairs) {
  std::vector<SelfCollision::LinkPair> result;
  for (std::size_t i = 0; i < pairs.shape(0); ++i) {
    result.emplace_back(static_cast<std::uint32_t>(pairs(i, 0)), static_cast<std::uint32_t>(pairs(i, 1)));
  }
  return result;
}

}  // namespace

void bind_collision(nb::module_& m) {
  nb::class_<CollisionMesh>(m, "CollisionMesh")
      .def(
          "__init__",
          [](CollisionMesh* self, const Points64& vertices, const Indices3& triangles) {
            Release release;
            new (self)
                CollisionMesh({vertices.data(), 3 * vertices.shape(0)}, {triangles.data(), 3 * triangles.shape(0)});
          },
          nb::arg("vertices"), nb::arg("triangles"),
          nb::sig("def __init__(self, vertices: NDArray[numpy.float64], triangles: NDArray[numpy.int64]) -> None"))
      .def_prop_ro("triangle_count", &CollisionMesh::triangle_count)
      .def_prop_ro("component_count", [](const CollisionMesh& mesh) { return mesh.components().size(); })
      .def_prop_ro("radius_m", &CollisionMesh::radius_m)
      .def_prop_ro("is_closed", &CollisionMesh::is_closed);

  nb::class_<KdopBvh>(m, "KdopBvh")
      .def_prop_ro("node_count", [](const KdopBvh& bvh) { return bvh.nodes().size(); })
      .def_prop_ro("depth", &KdopBvh::depth)
      .def_prop_ro("nbytes", &KdopBvh::nbytes)
      .def_prop_ro("k", [](const KdopBvh& bvh) { return bvh.options().axes.k(); });

  m.def("build_kdop_bvh", &build, nb::arg("mesh"), nb::arg("k"), nb::arg("axes").none(), nb::arg("branching_factor"),
        nb::arg("construction"), nb::arg("slabs"), nb::arg("traversal"), nb::arg("leaf_size"), nb::arg("seed"),
        nb::sig("def build_kdop_bvh(mesh: CollisionMesh, k: int, axes: NDArray[numpy.float64] | None, "
                "branching_factor: int, construction: str, slabs: str, traversal: str, leaf_size: int, seed: int) -> "
                "KdopBvh"));
  nb::class_<SelfCollision>(m, "SelfCollision")
      .def(
          "__init__",
          [](SelfCollision* self, std::vector<std::shared_ptr<KdopBvh>> links, const IndexPairs& pairs) {
            new (self) SelfCollision({links.begin(), links.end()}, link_pairs(pairs));
          },
          nb::arg("links"), nb::arg("pairs"),
          nb::sig("def __init__(self, links: list[KdopBvh | None], pairs: NDArray[numpy.int64]) -> None"))
      .def(
          "check",
          [](const SelfCollision& self, const LinkPoses& T_map_links) {
            std::vector<std::uint8_t> colliding;
            {
              Release release;
              colliding = self.check({T_map_links.data(), T_map_links.size()});
            }
            NewArray<std::uint8_t> result(colliding.size());
            std::copy(colliding.begin(), colliding.end(), result.data());
            return result.release();
          },
          nb::arg("T_map_links"),
          nb::sig("def check(self, T_map_links: NDArray[numpy.float64]) -> NDArray[numpy.uint8]"));
  m.def("collide", &collide_poses, nb::arg("a"), nb::arg("b"), nb::arg("T_a_b"), nb::arg("contacts"), nb::arg("solids"),
        nb::arg("statistics"),
        nb::sig("def collide(a: KdopBvh, b: KdopBvh, T_a_b: NDArray[numpy.float64], contacts: str, solids: bool, "
                "statistics: bool) -> tuple[NDArray[numpy.uint8], NDArray[numpy.int64], NDArray[numpy.int64]]"));
}

}  // namespace rayvox::bindings
