#include "rayvox/geometry/rigid_transform.hpp"

#include "check.hpp"
#include "rayvox/error.hpp"

using namespace rayvox;

FACT(a_pose_moves_points_by_rotation_then_translation) {
  const double quarter_turn_about_z[] = {0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1};
  const Vec3d p = RigidTransform::from_matrix(quarter_turn_about_z).apply({1, 2, 3});
  CHECK_EQUAL(p.x, 8.0);
  CHECK_EQUAL(p.y, 21.0);
  CHECK_EQUAL(p.z, 33.0);
}

FACT(matrices_that_are_not_rigid_are_refused) {
  const double scaled[] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1};
  const double mirrored[] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const double sheared[] = {1, 0.01, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const double projective[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1};
  const double infinite[] = {1, 0, 0, INFINITY, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  for (const double* matrix : {scaled, mirrored, sheared, projective, infinite}) {
    CHECK_THROWS(InvalidInput, RigidTransform::from_matrix(matrix));
  }
}
