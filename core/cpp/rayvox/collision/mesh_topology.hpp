#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "rayvox/collision/collision_mesh.hpp"

namespace rayvox {

struct MeshTopology {
  std::vector<MeshComponent> components;
  std::vector<std::uint32_t> component_of;  // per triangle
};

/// The connected parts of a mesh, and which of them are closed. Vertices at equal positions count as one; triangles
/// with two corners at one position have no inside and no border, and are ignored when edges are counted.
MeshTopology find_components(const std::vector<Vec3d>& vertices,
                             const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace rayvox
