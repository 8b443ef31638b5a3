#include <nanobind/stl/vector.h>

#include <algorithm>

#include "arrays.hpp"
#include "rayvox/error.hpp"
#include "rayvox/geometry/mesh_parts.hpp"
#include "rayvox/geometry/triangle_tree.hpp"
#include "rayvox/robot/kinematics.hpp"
#include "rayvox/robot/motion_bound.hpp"
#include "rayvox/robot/self_filter.hpp"
#include "rayvox/robot/surface_deviation.hpp"

namespace rayvox::bindings {
namespace {

using Release = nb::gil_scoped_release;
using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Poses = nb::ndarray<const double, nb::shape<-1, 4, 4>, nb::c_contig, nb::device::cpu>;
using Triangles = nb::ndarray<const std::int32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

TriangleMeshView mesh_view(const Points64& vertices, const Triangles& triangles) {
  return {{vertices.data(), vertices.size()}, {triangles.data(), triangles.size()}};
}

void require_columns(const Rows& configurations, const KinematicTree& tree) {
  if (configurations.shape(1) != tree.configuration_size()) {
    throw InvalidInput("configurations must have shape (n, " + std::to_string(tree.configuration_size()) + "), got (" +
                       std::to_string(configurations.shape(0)) + ", " + std::to_string(configurations.shape(1)) + ")");
  }
}

std::vector<LinkExtent> extents_of(const Rows& capsules) {
  if (capsules.shape(1) != 7) throw InvalidInput("a capsule is 7 numbers: from, to, radius");
  std::vector<LinkExtent> extents;
  for (std::size_t i = 0; i < capsules.shape(0); ++i) {
    const double* c = capsules.data() + 7 * i;
    extents.push_back({{c[0], c[1], c[2]}, {c[3], c[4], c[5]}, c[6]});
  }
  return extents;
}

void make_tree(KinematicTree* self, const std::vector<int>& parents, const std::vector<int>& motions,
               const Poses& T_parent_joints, const Points64& axes, const std::vector<int>& columns, const Rows& mimic,
               std::size_t configuration_size) {
  const std::size_t count = parents.size();
  if (motions.size() != count || T_parent_joints.shape(0) != count || axes.shape(0) != count ||
      columns.size() != count || mimic.shape(0) != count || mimic.shape(1) != 2) {
    throw InvalidInput("a kinematic tree needs one joint per link");
  }
  std::vector<LinkJoint> joints(count);
  for (std::size_t i = 0; i < count; ++i) {
    joints[i].parent = parents[i];
    joints[i].motion = static_cast<JointMotion>(motions[i]);
    std::copy_n(T_parent_joints.data() + 16 * i, 16, joints[i].T_parent_joint.begin());
    joints[i].axis = view(axes)[i];
    joints[i].column = columns[i];
    joints[i].multiplier = mimic.data()[2 * i];
    joints[i].offset = mimic.data()[2 * i + 1];
  }
  new (self) KinematicTree(std::move(joints), configuration_size);
}

nb::object link_poses(const KinematicTree& tree, const Rows& configurations, const Poses& T_map_base) {
  require_columns(configurations, tree);
  const std::size_t count = configurations.shape(0), links = tree.link_count();
  NewArray<double> poses(16 * count * links);
  {
    Release release;
    tree.link_poses(configurations.data(), count, T_map_base.data(), T_map_base.shape(0), poses.data());
  }
  return poses.release().attr("reshape")(count, links, 4, 4);
}

nb::object bounds(const KinematicTree& tree, const Rows& capsules, const Rows& from, const Rows& to,
                  const Poses& T_map_base_from, const Poses& T_map_base_to) {
  require_columns(from, tree);
  require_columns(to, tree);
  const std::size_t count = from.shape(0), base_count = T_map_base_from.shape(0);
  if (to.shape(0) != count || T_map_base_to.shape(0) != base_count || (base_count != 1 && base_count != count)) {
    throw InvalidInput("a motion needs as many configurations to go to as from, and one base pose for each or for all");
  }
  NewArray<double> out(count * tree.link_count());
  {
    Release release;
    motion_bounds(tree, extents_of(capsules),
                  {from.data(), to.data(), T_map_base_from.data(), T_map_base_to.data(), count, base_count},
                  out.data());
  }
  return out.release().attr("reshape")(count, tree.link_count());
}

nb::object welded(const Points64& vertices) {
  NewArray<std::int32_t> out(vertices.shape(0));
  {
    Release release;
    const std::vector<std::int32_t> place = weld_vertices({vertices.data(), vertices.size()});
    std::copy(place.begin(), place.end(), out.data());
  }
  return out.release();
}

nb::tuple parts_of(const Points64& vertices, const Triangles& triangles) {
  MeshParts parts;
  {
    Release release;
    parts = find_parts(mesh_view(vertices, triangles));
  }
  NewArray<std::int32_t> part(parts.part.size());
  NewArray<bool> closed(parts.closed.size());
  std::copy(parts.part.begin(), parts.part.end(), part.data());
  std::copy(parts.closed.begin(), parts.closed.end(), closed.data());
  return nb::make_tuple(part.release(), closed.release());
}

nb::object distances(const TriangleTree& tree, const Points64& points) {
  NewArray<double> out(points.shape(0));
  {
    Release release;
    for (std::size_t i = 0; i < points.shape(0); ++i) out.data()[i] = tree.nearest(view(points)[i]).distance;
  }
  return out.release();
}

nb::object insides(const TriangleTree& tree, const Points64& points) {
  NewArray<bool> out(points.shape(0));
  {
    Release release;
    for (std::size_t i = 0; i < points.shape(0); ++i) out.data()[i] = tree.inside(view(points)[i]);
  }
  return out.release();
}

template <class Points>
nb::object filter(const std::vector<const TriangleTree*>& meshes, const Rows& capsules,
                  const std::vector<double>& paddings_m, const Poses& T_frame_links, const Points& points,
                  const Points64& origin_m) {
  const std::vector<LinkExtent> extents = extents_of(capsules);
  if (extents.size() != meshes.size() || paddings_m.size() != meshes.size() ||
      T_frame_links.shape(0) != meshes.size() || origin_m.shape(0) != 1) {
    throw InvalidInput("a body filter needs one capsule, padding and pose per link, and one origin");
  }
  std::vector<FilterLink> links;
  for (std::size_t i = 0; i < meshes.size(); ++i) links.push_back({meshes[i], extents[i], paddings_m[i]});
  NewArray<std::uint8_t> out(points.shape(0));
  {
    Release release;
    filter_body(links, T_frame_links.data(), view(points), view(origin_m)[0], out.data());
  }
  return out.release();
}

}  // namespace

#define F64 "NDArray[numpy.float64]"

void bind_robot(nb::module_& m) {
  nb::class_<KinematicTree>(m, "KinematicTree")
      .def("__init__", &make_tree, nb::arg("parents"), nb::arg("motions"), nb::arg("T_parent_joints"), nb::arg("axes"),
           nb::arg("columns"), nb::arg("mimic"), nb::arg("configuration_size"),
           nb::sig("def __init__(self, parents: list[int], motions: list[int], T_parent_joints: " F64 ", axes: " F64
                   ", columns: list[int], mimic: " F64 ", configuration_size: int) -> None"))
      .def("link_poses", &link_poses, nb::arg("configurations"), nb::arg("T_map_base"),
           nb::sig("def link_poses(self, configurations: " F64 ", T_map_base: " F64 ") -> " F64))
      .def("motion_bounds", &bounds, nb::arg("capsules"), nb::arg("q_from"), nb::arg("q_to"),
           nb::arg("T_map_base_from"), nb::arg("T_map_base_to"),
           nb::sig("def motion_bounds(self, capsules: " F64 ", q_from: " F64 ", q_to: " F64 ", T_map_base_from: " F64
                   ", T_map_base_to: " F64 ") -> " F64));
  nb::class_<TriangleTree>(m, "TriangleTree")
      .def(
          "__init__",
          [](TriangleTree* self, const Points64& vertices, const Triangles& triangles) {
            Release release;
            new (self) TriangleTree(mesh_view(vertices, triangles));
          },
          nb::arg("vertices"), nb::arg("triangles"),
          nb::sig("def __init__(self, vertices: " F64 ", triangles: NDArray[numpy.int32]) -> None"))
      .def("distances", &distances, nb::arg("points"), nb::sig("def distances(self, points: " F64 ") -> " F64))
      .def("inside", &insides, nb::arg("points"), nb::sig("def inside(self, points: " F64 ") -> NDArray[numpy.bool_]"))
      .def(
          "deviation_of",
          [](const TriangleTree& simplified, const Points64& vertices, const Triangles& triangles, double limit_m) {
            Release release;
            return surface_deviation(mesh_view(vertices, triangles), simplified, limit_m);
          },
          nb::arg("vertices"), nb::arg("triangles"), nb::arg("limit_m"),
          nb::sig("def deviation_of(self, vertices: " F64
                  ", triangles: NDArray[numpy.int32], limit_m: float) -> float"));
  m.def("weld_vertices", &welded, nb::arg("vertices"),
        nb::sig("def weld_vertices(vertices: " F64 ") -> NDArray[numpy.int32]"));
  m.def("mesh_parts", &parts_of, nb::arg("vertices"), nb::arg("triangles"),
        nb::sig("def mesh_parts(vertices: " F64
                ", triangles: NDArray[numpy.int32]) -> tuple[NDArray[numpy.int32], NDArray[numpy.bool_]]"));
  m.def("filter_body", &filter<Points32>, nb::arg("meshes"), nb::arg("capsules"), nb::arg("paddings_m"),
        nb::arg("T_frame_links"), nb::arg("points"), nb::arg("origin_m"),
        nb::sig("def filter_body(meshes: list[TriangleTree | None], capsules: " F64
                ", paddings_m: list[float], T_frame_links: " F64 ", points: NDArray[numpy.float32], origin_m: " F64
                ") -> NDArray[numpy.uint8]"));
  m.def("filter_body", &filter<Points64>, nb::arg("meshes"), nb::arg("capsules"), nb::arg("paddings_m"),
        nb::arg("T_frame_links"), nb::arg("points"), nb::arg("origin_m"),
        nb::sig("def filter_body(meshes: list[TriangleTree | None], capsules: " F64
                ", paddings_m: list[float], T_frame_links: " F64 ", points: NDArray[numpy.float64], origin_m: " F64
                ") -> NDArray[numpy.uint8]"));
}

#undef F64

}  // namespace rayvox::bindings
