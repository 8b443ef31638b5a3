#pragma once
#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/collision/relative_placement.hpp"

namespace rayvox {

/// The closed components of a mesh as solids, and which points they contain. Exact for points not on the surface.
class Solid {
 public:
  explicit Solid(const KdopBvh& bvh);

  /// Whether there is a closed component.
  bool exists() const { return exists_; }
  /// Whether a closed component contains p (relative to the mesh's centre): its surface winds around p, or, where its
  /// triangles are not oriented consistently, a ray from p crosses it an odd number of times.
  bool contains(const Vec3d& p) const;
  /// Whether a component of `other` lies inside, given that the surfaces do not touch. `to_here` maps other's points.
  template <class Map>
  bool contains_component_of(const CollisionMesh& other, const Map& to_here) const {
    if (!exists_) return false;
    for (const MeshComponent& part : other.components()) {
      bool in_box = true;
      for (std::size_t i = 0; i < 6 && in_box; ++i) in_box = box_holds(to_here(other.vertex(part.extreme[i])));
      if (in_box && contains(to_here(other.vertex(part.extreme[0])))) return true;
    }
    return false;
  }

 private:
  bool box_holds(const Vec3d& p) const;

  const KdopBvh& bvh_;
  bool exists_ = false;
  Vec3d low_m_, high_m_;  // of the closed components
};

}  // namespace rayvox
