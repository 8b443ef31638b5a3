#pragma once
#include <cstdint>
#include <vector>

#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/collision/relative_placement.hpp"

namespace rayvox {

/// The closed components of a mesh as solids, and which points they contain. Exact for points not on the surface.
class Solid {
 public:
  explicit Solid(const KdopBvh& bvh);

  /// Whether there is a closed component.
  bool exists() const { return !parts_.empty(); }
  /// The box around the closed components, if there are any, relative to the mesh's centre.
  const Vec3d& low() const { return box_.low; }
  const Vec3d& high() const { return box_.high; }
  /// Whether a closed component contains p (relative to the mesh's centre): its surface winds around p, or, where its
  /// triangles are not oriented consistently, a ray from p crosses it an odd number of times.
  bool contains(const Vec3d& p) const;
  /// Whether a component of `other` lies inside, given that the surfaces do not touch. `to_here` maps other's points.
  template <class Map>
  bool contains_component_of(const CollisionMesh& other, const Map& to_here) const {
    if (!exists()) return false;
    for (const MeshComponent& part : other.components()) {
      const Vec3d first = to_here(part.extreme[0]);
      if (!box_.holds(first)) continue;
      std::vector<std::uint32_t> around;
      for (const ClosedPart& closed : parts_) {
        bool inside = closed.box.holds(first);
        for (std::size_t i = 1; i < 6 && inside; ++i) inside = closed.box.holds(to_here(part.extreme[i]));
        if (inside) around.push_back(closed.component);
      }
      if (!around.empty() && one_contains(around, first)) return true;
    }
    return false;
  }

 private:
  struct Box {
    Vec3d low, high;
    bool holds(const Vec3d& p) const {
      // Without branches: which of these fails is anyone's guess.
      return static_cast<bool>(static_cast<int>(p.x >= low.x) & static_cast<int>(p.x <= high.x) &
                               static_cast<int>(p.y >= low.y) & static_cast<int>(p.y <= high.y) &
                               static_cast<int>(p.z >= low.z) & static_cast<int>(p.z <= high.z));
    }
  };
  struct ClosedPart {
    std::uint32_t component;
    Box box;
  };

  bool one_contains(const std::vector<std::uint32_t>& components, const Vec3d& p) const;

  const KdopBvh& bvh_;
  std::vector<ClosedPart> parts_;
  Box box_;  // of all closed components
};

}  // namespace rayvox
