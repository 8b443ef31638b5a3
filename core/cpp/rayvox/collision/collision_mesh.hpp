#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rayvox/collision/triangle.hpp"
#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// A connected part of a mesh (connected through vertices at equal positions).
struct MeshComponent {
  /// What the part bounds. `oriented`: each edge is passed as often in one direction as in the other, so that windings
  /// around a point are well defined; `even`: each edge has an even number of triangles, so that crossings' parity is.
  enum class Kind : std::uint8_t { open, even, oriented };
  Kind kind;
  std::array<Vec3d, 6> extreme;  // its vertices lowest in x, y, z and highest in x, y, z, relative to the mesh's centre

  Vec3d low() const { return {extreme[0].x, extreme[1].y, extreme[2].z}; }
  Vec3d high() const { return {extreme[3].x, extreme[4].y, extreme[5].z}; }
};

/// A triangle mesh at rest: vertices float64, stored relative to the centre of their box, so that a mesh far from its
/// own frame's origin loses nothing. Immutable.
class CollisionMesh {
 public:
  /// Largest coordinate, metres: products of three differences stay below float32's overflow, beyond which the
  /// triangle filter's error bounds say nothing.
  static constexpr double most_m = 1e11;

  /// vertices: 3 coordinates each, metres; triangles: 3 vertex indices each. Throws InvalidInput for no triangle, a
  /// coordinate that is not finite or beyond most_m, or an index out of range, naming it.
  CollisionMesh(std::span<const double> vertices, std::span<const std::int64_t> triangles);

  std::size_t vertex_count() const { return vertices_.size(); }
  std::size_t triangle_count() const { return triangles_.size(); }
  /// Relative to centre_m(). Vertices that no triangle uses are kept, and bound nothing.
  const Vec3d& vertex(std::size_t index) const { return vertices_[index]; }
  const std::array<std::uint32_t, 3>& triangle_vertices(std::size_t index) const { return triangles_[index]; }
  Triangle triangle(std::size_t index) const {
    const auto& t = triangles_[index];
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
  }
  const Vec3d& centre_m() const { return centre_m_; }
  /// Largest distance of a triangle's corner from the centre.
  double radius_m() const { return radius_m_; }

  const std::vector<MeshComponent>& components() const { return components_; }
  std::uint32_t component_of(std::size_t triangle) const { return component_of_[triangle]; }
  /// Whether every component bounds a solid.
  bool is_closed() const;

 private:
  void find_centre(std::span<const double> vertices);

  std::vector<Vec3d> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  Vec3d centre_m_;
  double radius_m_ = 0;
  std::vector<MeshComponent> components_;
  std::vector<std::uint32_t> component_of_;
};

}  // namespace rayvox
