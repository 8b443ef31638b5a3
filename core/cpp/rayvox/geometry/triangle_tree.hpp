#pragma once
// A mesh kept for questions about distance: a binary tree of axis-aligned boxes, split at the median.
#include <cstdint>
#include <limits>
#include <vector>

#include "rayvox/geometry/triangle_mesh.hpp"

namespace rayvox {

/// Immutable; every query may run in any number of threads.
class TriangleTree {
 public:
  struct Nearest {
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t triangle = 0;  ///< index in the mesh it was built from
  };

  /// Copies the mesh. Throws InvalidInput as require_valid, or for a mesh without triangles.
  explicit TriangleTree(const TriangleMeshView& mesh);

  std::size_t triangle_count() const { return triangles_.size(); }
  const Triangle& triangle(std::uint32_t i) const { return triangles_[slot_of_[i]]; }

  /// The triangle nearest to a point, if any is nearer than `within`; an infinite distance else.
  Nearest nearest(const Vec3d& p, double within = std::numeric_limits<double>::infinity()) const;

  /// Whether any triangle lies within the distance of the point, or of the segment.
  bool touches(const Vec3d& p, double distance) const;
  bool touches(const Vec3d& from, const Vec3d& to, double distance) const;

  /// Whether a point lies inside a closed part of the mesh (find_parts), by the parity of its crossings along +x.
  /// Which side a point on the surface itself is on is decided by rounding.
  bool inside(const Vec3d& p) const;

 private:
  struct Node {
    Vec3d low, high;
    std::uint32_t first = 0;  // leaf: first triangle slot; inner: left child, the right one follows it
    std::uint32_t count = 0;  // leaf: triangles; inner: 0
  };
  void build(const TriangleMeshView& mesh);
  void emit_node(std::vector<std::uint32_t>& order, std::size_t first, std::size_t last,
                 const std::vector<Vec3d>& centres, const TriangleMeshView& mesh, std::size_t node);

  /// Whether `accept` takes any triangle, by slot, of the nodes whose box `enter` lets in.
  template <class Enter, class Accept>
  bool any_triangle(const Enter& enter, const Accept& accept) const;

  std::vector<Node> nodes_;
  std::vector<Triangle> triangles_;        // by slot, leaf after leaf
  std::vector<std::uint32_t> index_of_;    // slot -> index in the mesh
  std::vector<std::uint32_t> slot_of_;     // and back
  std::vector<std::int32_t> closed_part_;  // by slot; -1 for triangles of open parts
};

}  // namespace rayvox
