#pragma once
// Meshes and poses for the collision tests, by seeded generators.
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "rayvox/collision/collision_mesh.hpp"

namespace collision_meshes {

using rayvox::CollisionMesh;
using rayvox::Vec3d;

struct Soup {
  std::vector<double> vertices;
  std::vector<std::int64_t> triangles;

  void add(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    for (const Vec3d& p : {a, b, c}) {
      triangles.push_back(static_cast<std::int64_t>(vertices.size() / 3));
      vertices.insert(vertices.end(), {p.x, p.y, p.z});
    }
  }
  void add_quad(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    add(a, b, c);
    add(a, c, d);
  }
  void transform(double scale, const Vec3d& offset) {
    for (std::size_t i = 0; i < vertices.size(); ++i)
      vertices[i] = vertices[i] * scale + offset[static_cast<int>(i % 3)];
  }
  std::shared_ptr<const CollisionMesh> mesh() const { return std::make_shared<CollisionMesh>(vertices, triangles); }
};

inline double uniform(std::mt19937_64& random, double low = -1, double high = 1) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline Vec3d point(std::mt19937_64& random, double size = 1) {
  return {uniform(random) * size, uniform(random) * size, uniform(random) * size};
}

/// Triangles of mixed sizes in a unit ball, some of them slivers, segments, points, duplicates or on one plane.
inline Soup random_soup(std::mt19937_64& random, int count, double size = 0.3) {
  Soup soup;
  for (int i = 0; i < count; ++i) {
    const Vec3d at = point(random, 0.6);
    const double s = size * std::exp(uniform(random, -2, 0.5));
    Vec3d a = at + point(random, s), b = at + point(random, s), c = at + point(random, s);
    switch (random() % 10) {
      case 0: c = a + (b - a) * uniform(random) + point(random, 1e-8 * s); break;
      case 1: c = a + (b - a) * 0.5; break;
      case 2: b = c = a; break;
      case 3: a.z = b.z = c.z = 0.125; break;
      default: break;
    }
    soup.add(a, b, c);
    if (random() % 10 == 0) soup.add(b, a, c);
  }
  return soup;
}

/// A box's twelve triangles, outward.
inline void add_box(Soup& soup, const Vec3d& low, const Vec3d& high, bool outward = true) {
  const auto corner = [&](int bits) {
    return Vec3d{bits & 1 ? high.x : low.x, bits & 2 ? high.y : low.y, bits & 4 ? high.z : low.z};
  };
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    if (outward)
      soup.add_quad(corner(q[0]), corner(q[1]), corner(q[2]), corner(q[3]));
    else
      soup.add_quad(corner(q[3]), corner(q[2]), corner(q[1]), corner(q[0]));
  }
}

/// A sphere of 2 * rings * segments triangles (less at the poles).
inline Soup sphere(int rings, int segments, double radius = 1) {
  Soup soup;
  const auto at = [&](int ring, int segment) {
    const double theta = M_PI * ring / rings, phi = 2 * M_PI * (segment % segments) / segments;
    const double s = ring == 0 || ring == rings ? 0 : std::sin(theta);
    return Vec3d{radius * s * std::cos(phi), radius * s * std::sin(phi), radius * std::cos(theta)};
  };
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < segments; ++s) {
      if (r > 0) soup.add(at(r, s), at(r + 1, s), at(r, s + 1));
      if (r < rings - 1) soup.add(at(r + 1, s), at(r + 1, s + 1), at(r, s + 1));
    }
  }
  return soup;
}

using Matrix = std::array<double, 16>;

inline Matrix identity() { return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; }

inline Matrix translated(const Vec3d& t) {
  Matrix m = identity();
  for (std::size_t i = 0; i < 3; ++i) m[4 * i + 3] = t[static_cast<int>(i)];
  return m;
}

inline Matrix random_pose(std::mt19937_64& random, double reach) {
  std::normal_distribution<double> normal;
  double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
  const double n = std::sqrt(w * w + x * x + y * y + z * z);
  w /= n, x /= n, y /= n, z /= n;
  const Vec3d t = point(random, reach);
  return {1 - 2 * (y * y + z * z),
          2 * (x * y - w * z),
          2 * (x * z + w * y),
          t.x,
          2 * (x * y + w * z),
          1 - 2 * (x * x + z * z),
          2 * (y * z - w * x),
          t.y,
          2 * (x * z - w * y),
          2 * (y * z + w * x),
          1 - 2 * (x * x + y * y),
          t.z,
          0,
          0,
          0,
          1};
}

}  // namespace collision_meshes
