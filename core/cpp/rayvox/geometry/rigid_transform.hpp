#pragma once
#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// A rigid transform, float64. `T_a_b` maps coordinates in frame b to frame a.
class RigidTransform {
 public:
  RigidTransform() = default;

  /// From a row-major 4x4 matrix. Throws InvalidInput naming what is wrong unless it is finite, its last row is
  /// 0 0 0 1, and its 3x3 part is a rotation to within 1e-5 (a float32 pose passes, a scaled one does not).
  static RigidTransform from_matrix(const double* row_major_4x4);

  Vec3d apply(const Vec3d& p) const {
    return {r_[0] * p.x + r_[1] * p.y + r_[2] * p.z + t_.x, r_[3] * p.x + r_[4] * p.y + r_[5] * p.z + t_.y,
            r_[6] * p.x + r_[7] * p.y + r_[8] * p.z + t_.z};
  }

  /// Row-major 3x3.
  const double* rotation() const { return r_; }
  const Vec3d& translation() const { return t_; }

 private:
  double r_[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vec3d t_;
};

}  // namespace rayvox
