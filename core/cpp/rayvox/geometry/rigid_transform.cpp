#include "rayvox/geometry/rigid_transform.hpp"

#include <string>

#include "rayvox/error.hpp"

namespace rayvox {
namespace {

constexpr double rotation_tolerance = 1e-5;

void require_rotation(const double r[9]) {
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      const double dot = r[3 * i] * r[3 * j] + r[3 * i + 1] * r[3 * j + 1] + r[3 * i + 2] * r[3 * j + 2];
      if (std::abs(dot - (i == j ? 1.0 : 0.0)) > rotation_tolerance) {
        throw InvalidInput("pose is not rigid: rows " + std::to_string(i) + " and " + std::to_string(j) +
                           " of its 3x3 part have the scalar product " + std::to_string(dot));
      }
    }
  }
  const double determinant =
      r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
  if (determinant < 0) throw InvalidInput("pose is not rigid: it mirrors (determinant -1)");
}

}  // namespace

RigidTransform RigidTransform::from_matrix(const double* m) {
  for (int i = 0; i < 16; ++i) {
    if (!std::isfinite(m[i])) {
      throw InvalidInput("pose[" + std::to_string(i / 4) + "][" + std::to_string(i % 4) +
                         "] is not finite: " + std::to_string(m[i]));
    }
  }
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) throw InvalidInput("pose's last row is not 0 0 0 1");
  RigidTransform T;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) T.r_[3 * i + j] = m[4 * i + j];
    T.t_[i] = m[4 * i + 3];
  }
  require_rotation(T.r_);
  return T;
}

}  // namespace rayvox
