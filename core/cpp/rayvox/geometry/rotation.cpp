#include "rayvox/geometry/rotation.hpp"

#include <algorithm>
#include <cmath>

namespace rayvox {

double deviation_from_rotation(const double* r) {
  double most = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      const double dot = r[i] * r[j] + r[3 + i] * r[3 + j] + r[6 + i] * r[6 + j];
      most = std::max(most, std::abs(dot - (i == j ? 1 : 0)));
    }
  }
  return most;
}

void invert_rotation(const double* r, double* inverse) {
  const double cofactor[9] = {r[4] * r[8] - r[5] * r[7], r[2] * r[7] - r[1] * r[8], r[1] * r[5] - r[2] * r[4],
                              r[5] * r[6] - r[3] * r[8], r[0] * r[8] - r[2] * r[6], r[2] * r[3] - r[0] * r[5],
                              r[3] * r[7] - r[4] * r[6], r[1] * r[6] - r[0] * r[7], r[0] * r[4] - r[1] * r[3]};
  const double per_determinant = 1 / (r[0] * cofactor[0] + r[1] * cofactor[3] + r[2] * cofactor[6]);
  for (int i = 0; i < 9; ++i) inverse[i] = cofactor[i] * per_determinant;
}

}  // namespace rayvox
