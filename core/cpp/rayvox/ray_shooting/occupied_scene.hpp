#pragma once
// First hits through Embree (Min, Han, Kim 2021, section IV-A: leaves as axis-aligned boxes in a BVH): a scene of the
// occupied leaves of one snapshot. Embree proposes boxes in the order of its hierarchy;
// what a ray enters, and where first, is decided in float64 and, where that is too close, by exact arithmetic.
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/embree_library.hpp"
#include "rayvox/ray_shooting/ray.hpp"

namespace rayvox {

class OccupiedScene {
 public:
  struct Box {
    Cell first;
    int level;  // 2^level cells along each axis
  };
  struct Hit {
    double t;  // ray parameter at which the voxel is entered
    Cell voxel;
  };
  enum class Answer { hit, nothing, undecided };

  /// Nothing if the snapshot's occupied leaves span more than float32 can hold apart.
  static std::optional<OccupiedScene> of(const MapSnapshot& map, const EmbreeLibrary& library);
  OccupiedScene(OccupiedScene&& other) noexcept;
  OccupiedScene(const OccupiedScene&) = delete;
  ~OccupiedScene();

  /// The first occupied voxel that the ray passes or ends in. `undecided` if two are entered too close together.
  Answer cast(const Ray& ray, Hit& hit) const;

  /// What Embree's callbacks read.
  struct Boxes {
    std::vector<Box> box;
    Cell anchor;
    float widening;
  };

 private:
  OccupiedScene(const EmbreeLibrary& library, std::unique_ptr<Boxes> boxes);

  const EmbreeLibrary* embree_;
  std::unique_ptr<Boxes> boxes_;
  embree::SceneHandle* scene_;
};

}  // namespace rayvox
