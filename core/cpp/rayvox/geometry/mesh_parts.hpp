#pragma once
// Which triangles bound a solid.
#include <cstdint>
#include <vector>

#include "rayvox/geometry/triangle_mesh.hpp"

namespace rayvox {

/// Numbers the places of (n, 3) coordinates: vertices at the same place, -0 being 0, get the same number.
std::vector<std::int32_t> weld_vertices(std::span<const double> vertices);

/// The parts of a mesh: triangles that hang together over edges shared by exactly two. Vertices at the same place count
/// as one, a triangle given twice counts once, and one that is only a line or a point belongs to no part.
struct MeshParts {
  static constexpr std::int32_t none = -1;
  std::vector<std::int32_t> part;    ///< per triangle; `none` for a repeated or degenerate one
  std::vector<std::uint8_t> closed;  ///< per part: 1 where each of its edges has an even number of its triangles
};

/// Within a closed part inside and outside are told apart by the parity of crossings, whichever way its triangles are
/// wound. Throws InvalidInput as require_valid.
MeshParts find_parts(const TriangleMeshView& mesh);

}  // namespace rayvox
