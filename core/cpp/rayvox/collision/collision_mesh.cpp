#include "rayvox/collision/collision_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "rayvox/collision/mesh_topology.hpp"
#include "rayvox/error.hpp"

namespace rayvox {
namespace {

std::vector<std::array<std::uint32_t, 3>> checked_triangles(std::span<const std::int64_t> indices,
                                                            std::size_t vertices) {
  if (indices.empty()) throw InvalidInput("a mesh needs at least one triangle");
  std::vector<std::array<std::uint32_t, 3>> triangles(indices.size() / 3);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < 0 || static_cast<std::uint64_t>(indices[i]) >= vertices) {
      throw InvalidInput("triangles[" + std::to_string(i / 3) + "][" + std::to_string(i % 3) + "] is " +
                         std::to_string(indices[i]) + "; there are " + std::to_string(vertices) + " vertices");
    }
    triangles[i / 3][i % 3] = static_cast<std::uint32_t>(indices[i]);
  }
  return triangles;
}

void require_usable(std::span<const double> vertices) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!(std::abs(vertices[i]) <= CollisionMesh::most_m)) {
      throw InvalidInput("vertices[" + std::to_string(i / 3) + "][" + std::to_string(i % 3) + "] is " +
                         std::to_string(vertices[i]) + ": not finite or beyond 1e11 m");
    }
  }
}

}  // namespace

CollisionMesh::CollisionMesh(std::span<const double> vertices, std::span<const std::int64_t> triangles) {
  require_usable(vertices);
  if (vertices.size() / 3 > 0x3fffffff || triangles.size() / 3 > 0x3fffffff) {
    throw InvalidInput("a mesh has at most 2^30 - 1 vertices and triangles");
  }
  triangles_ = checked_triangles(triangles, vertices.size() / 3);
  find_centre(vertices);
  MeshTopology topology = find_components(vertices_, triangles_);
  components_ = std::move(topology.components);
  component_of_ = std::move(topology.component_of);
}

void CollisionMesh::find_centre(std::span<const double> vertices) {
  const auto at = [&](std::uint32_t v) { return Vec3d{vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]}; };
  Vec3d low = at(triangles_[0][0]), high = low;
  for (const auto& triangle : triangles_) {
    for (const std::uint32_t v : triangle) {
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], at(v)[axis]);
        high[axis] = std::max(high[axis], at(v)[axis]);
      }
    }
  }
  centre_m_ = (low + high) * 0.5;
  vertices_.resize(vertices.size() / 3);
  for (std::size_t i = 0; i < vertices_.size(); ++i) vertices_[i] = at(static_cast<std::uint32_t>(i)) - centre_m_;
  for (const auto& triangle : triangles_) {
    for (const std::uint32_t v : triangle) radius_m_ = std::max(radius_m_, norm(vertices_[v]));
  }
}

bool CollisionMesh::is_closed() const {
  return std::all_of(components_.begin(), components_.end(),
                     [](const MeshComponent& c) { return c.kind != MeshComponent::Kind::open; });
}

}  // namespace rayvox
