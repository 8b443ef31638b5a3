#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// Corners of one triangle.
using Triangle = std::array<Vec3d, 3>;

/// A mesh that lies elsewhere: (n, 3) coordinates and (m, 3) indices, row-major.
struct TriangleMeshView {
  std::span<const double> vertices;
  std::span<const std::int32_t> triangles;

  std::size_t vertex_count() const { return vertices.size() / 3; }
  std::size_t triangle_count() const { return triangles.size() / 3; }
  Vec3d vertex(std::size_t i) const { return {vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]}; }
  Triangle triangle(std::size_t i) const {
    const auto corner = [&](std::size_t k) { return vertex(static_cast<std::size_t>(triangles[3 * i + k])); };
    return {corner(0), corner(1), corner(2)};
  }
};

/// Throws InvalidInput naming the first vertex that is not finite, or the first triangle with an index out of range.
void require_valid(const TriangleMeshView& mesh);

}  // namespace rayvox
