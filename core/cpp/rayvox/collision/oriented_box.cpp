#include "rayvox/collision/oriented_box.hpp"

#include <algorithm>
#include <cmath>

namespace rayvox {
namespace {

Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

struct Symmetric {
  double m[3][3];
};

// One Jacobi rotation that zeroes m[p][q]; `axes` holds the rotated basis as columns.
void rotate(Symmetric& s, double axes[3][3], int p, int q) {
  if (s.m[p][q] == 0) return;
  const double theta = (s.m[q][q] - s.m[p][p]) / (2 * s.m[p][q]);
  const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
  const double c = 1 / std::sqrt(t * t + 1), sine = t * c;
  for (int i = 0; i < 3; ++i) {
    const double ip = s.m[i][p], iq = s.m[i][q];
    s.m[i][p] = c * ip - sine * iq;
    s.m[i][q] = sine * ip + c * iq;
  }
  for (int i = 0; i < 3; ++i) {
    const double pi = s.m[p][i], qi = s.m[q][i];
    s.m[p][i] = c * pi - sine * qi;
    s.m[q][i] = sine * pi + c * qi;
  }
  for (int i = 0; i < 3; ++i) {
    const double ip = axes[i][p], iq = axes[i][q];
    axes[i][p] = c * ip - sine * iq;
    axes[i][q] = sine * ip + c * iq;
  }
}

}  // namespace

void SurfaceMoments::add(const Triangle& t, double least_weight) {
  const Vec3d middle = (t[0] + t[1] + t[2]) * (1.0 / 3);
  const double weight = norm(cross(t[1] - t[0], t[2] - t[0])) / 2 + least_weight;
  value[0] += weight;
  for (int i = 0; i < 3; ++i) value[static_cast<std::size_t>(1 + i)] += weight * middle[i];
  // The second moment of a triangle: a twelfth of (sum of its corners' squares + nine times the middle's square).
  std::size_t k = 4;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j, ++k) {
      const double corners = t[0][i] * t[0][j] + t[1][i] * t[1][j] + t[2][i] * t[2][j];
      value[k] += weight / 12 * (corners + 9 * middle[i] * middle[j]);
    }
  }
}

void SurfaceMoments::add(const SurfaceMoments& other) {
  for (std::size_t i = 0; i < value.size(); ++i) value[i] += other.value[i];
}

std::array<Vec3d, 3> principal_axes(const SurfaceMoments& moments) {
  const auto& v = moments.value;
  const double weight = v[0] > 0 ? v[0] : 1;
  const double mean[3] = {v[1] / weight, v[2] / weight, v[3] / weight};
  Symmetric s;
  std::size_t k = 4;
  double largest = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j, ++k) {
      s.m[i][j] = s.m[j][i] = v[k] / weight - mean[i] * mean[j];
      largest = std::max(largest, std::abs(s.m[i][j]));
    }
  }
  double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 12; ++sweep) {
    if (std::abs(s.m[0][1]) + std::abs(s.m[0][2]) + std::abs(s.m[1][2]) <= 1e-14 * largest) break;
    rotate(s, axes, 0, 1);
    rotate(s, axes, 0, 2);
    rotate(s, axes, 1, 2);
  }
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int a, int b) { return s.m[a][a] < s.m[b][b]; });
  std::array<Vec3d, 3> rows;
  for (std::size_t i = 0; i < 3; ++i) rows[i] = {axes[0][order[i]], axes[1][order[i]], axes[2][order[i]]};
  return rows;
}

}  // namespace rayvox
