#pragma once
#include <optional>
#include <vector>

#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/simd/collision_kernels.hpp"

namespace rayvox {

/// Mesh b placed in the frame of mesh a, both relative to their centres: x_a = rotation * x_b + translation.
struct Placement {
  double rotation[9], translation[3];
  Vec3d apply(const Vec3d& p) const {
    return {rotation[0] * p.x + rotation[1] * p.y + rotation[2] * p.z + translation[0],
            rotation[3] * p.x + rotation[4] * p.y + rotation[5] * p.z + translation[1],
            rotation[6] * p.x + rotation[7] * p.y + rotation[8] * p.z + translation[2]};
  }
};

/// What does not depend on the pose, of the queries between two hierarchies.
class PairTables {
 public:
  /// Throws InvalidInput unless the two have the same traversal, axes and slabs.
  PairTables(const KdopBvh& a, const KdopBvh& b, const CollisionKernels& kernels);

  /// None if the meshes' bounding spheres are certainly apart. The translation between the centres is rounded once,
  /// however far the meshes are from the origins of their frames.
  std::optional<Placement> place(const RigidTransform& T_a_b) const;
  /// Places b as `placement` says, for the kernels.
  void prepare(const Placement& placement, RelativePose& pose) const;

  const CollisionKernels& kernels() const { return kernels_; }
  const KdopBvh& a() const { return a_; }
  const KdopBvh& b() const { return b_; }
  /// Pairs of nodes that can wait at once in a depth-first traversal.
  std::size_t stack_capacity() const;

 private:
  void enclose_slabs(FrameChange& change) const;
  void align_kdops(RelativePose& pose) const;

  const KdopBvh &a_, &b_;
  const CollisionKernels& kernels_;
  OrientationRows orientations_{};
  std::vector<float> cone_planes_;
  ConeRows cones_{};
};

}  // namespace rayvox
