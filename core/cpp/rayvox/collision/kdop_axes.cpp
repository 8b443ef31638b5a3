#include "rayvox/collision/kdop_axes.hpp"

#include <cmath>
#include <string>

#include "rayvox/error.hpp"

namespace rayvox {
namespace {

Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

const std::vector<Vec3d> faces{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<Vec3d> corners{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
const std::vector<Vec3d> edges{{1, 1, 0}, {1, -1, 0}, {0, 1, 1}, {0, 1, -1}, {1, 0, 1}, {-1, 0, 1}};
// Eight and twelve lines spread by mutual repulsion: no direction is further from the nearest than 36.8 and 29.7
// degrees.
const std::vector<Vec3d> eight{{-0.719443, 0.560929, -0.409586},  {0.148886, -0.541847, -0.827185},
                               {-0.973442, 0.0612, 0.220602},     {0.273328, -0.945292, -0.178084},
                               {-0.536734, -0.092966, -0.838614}, {-0.478554, -0.195685, 0.855975},
                               {0.130063, 0.831126, -0.540661},   {-0.683464, -0.706421, -0.183971}};
const std::vector<Vec3d> twelve{
    {0.164084, 0.892671, -0.41978},   {0.109068, 0.323606, 0.939885},   {-0.924223, 0.371953, 0.086385},
    {0.752865, 0.643377, -0.138778},  {-0.527544, 0.232767, -0.817017}, {0.198117, -0.952265, -0.232252},
    {-0.189278, -0.364908, 0.911601}, {0.433806, 0.755979, 0.490212},   {0.787364, 0.135223, -0.601476},
    {-0.542455, 0.754754, -0.368903}, {0.906255, 0.173154, 0.385641},   {0.511647, -0.515743, -0.687187}};

// The lines through the vertices of an icosahedron and of its dual dodecahedron.
std::vector<Vec3d> sixteen() {
  const double golden = (1 + std::sqrt(5.0)) / 2, inverse = 1 / golden;
  std::vector<Vec3d> axes{{0, 1, golden},  {1, golden, 0},  {golden, 0, 1},
                          {0, 1, -golden}, {1, -golden, 0}, {golden, 0, -1}};
  axes.insert(axes.end(), corners.begin(), corners.end());
  for (const double s : {1.0, -1.0}) {
    axes.insert(axes.end(), {{0, golden, s * inverse}, {golden, s * inverse, 0}, {s * inverse, 0, golden}});
  }
  return axes;
}

std::vector<Vec3d> joined(std::vector<Vec3d> a, const std::vector<Vec3d>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// The faces of the convex hull of the orientations. Lifting each a little, by its own amount, makes every face a
// triangle.
std::vector<AxisCone> hull_cones(const KdopAxes& axes) {
  const int k = axes.k();
  std::vector<Vec3d> lifted;
  for (int i = 0; i < k; ++i) lifted.push_back(axes.orientation(i) * (1 + 2e-3 * ((i * 37) % 101) / 101.0));
  std::vector<AxisCone> cones;
  for (int a = 0; a < k; ++a) {
    for (int b = a + 1; b < k; ++b) {
      for (int c = b + 1; c < k; ++c) {
        const Vec3d normal = cross(lifted[b] - lifted[a], lifted[c] - lifted[a]);
        const double offset = dot(normal, lifted[a]);
        if (std::abs(offset) < 1e-9) continue;  // through the origin: no face
        const Vec3d plane = normal * (1 / offset);
        bool on_hull = true;
        for (int i = 0; i < k && on_hull; ++i) {
          on_hull = i == a || i == b || i == c || dot(plane, lifted[i]) < 1;
        }
        if (!on_hull) continue;
        const Vec3d p = axes.orientation(a), q = axes.orientation(b), r = axes.orientation(c);
        const double volume = dot(p, cross(q, r));
        cones.push_back(
            {plane, {a, b, c}, {cross(q, r) * (1 / volume), cross(r, p) * (1 / volume), cross(p, q) * (1 / volume)}});
      }
    }
  }
  return cones;
}

}  // namespace

KdopAxes::KdopAxes(std::vector<Vec3d> axes) : axes_(std::move(axes)) {
  if (axes_.size() < 3 || axes_.size() > most_axes) {
    throw InvalidInput("a k-DOP needs 3 to 16 axes, got " + std::to_string(axes_.size()));
  }
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const double length = norm(axes_[i]);
    if (!std::isfinite(length) || length == 0) throw InvalidInput("axis " + std::to_string(i) + " has no direction");
    axes_[i] = axes_[i] * (1 / length);
    for (std::size_t j = 0; j < i; ++j) {
      if (norm(cross(axes_[i], axes_[j])) < 1e-3) {
        throw InvalidInput("axes " + std::to_string(j) + " and " + std::to_string(i) + " are parallel");
      }
    }
  }
  double volume = 0;
  for (const Vec3d& axis : axes_) volume = std::max(volume, std::abs(dot(axis, cross(axes_[0], axes_[1]))));
  if (volume < 1e-3) throw InvalidInput("the axes do not span space");
  cones_ = hull_cones(*this);
}

KdopAxes KdopAxes::standard(int k) {
  switch (k) {
    case 6: return KdopAxes(faces);
    case 8: return KdopAxes(corners);
    case 14: return KdopAxes(joined(faces, corners));
    case 16: return KdopAxes(eight);
    case 18: return KdopAxes(joined(faces, edges));
    case 24: return KdopAxes(twelve);
    case 26: return KdopAxes(joined(joined(faces, corners), edges));
    case 32: return KdopAxes(sixteen());
    default: throw InvalidInput("k must be 6, 8, 14, 16, 18, 24, 26 or 32, got " + std::to_string(k));
  }
}

bool KdopAxes::operator==(const KdopAxes& other) const {
  if (count() != other.count()) return false;
  for (int i = 0; i < count(); ++i) {
    for (int j = 0; j < 3; ++j) {
      if ((*this)[i][j] != other[i][j]) return false;
    }
  }
  return true;
}

}  // namespace rayvox
