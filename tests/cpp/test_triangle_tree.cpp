#include "rayvox/geometry/triangle_tree.hpp"

#include <algorithm>
#include <random>

#include "check.hpp"
#include "rayvox/error.hpp"
#include "rayvox/geometry/mesh_parts.hpp"
#include "rayvox/geometry/triangle_distance.hpp"
#include "rayvox/robot/surface_deviation.hpp"

using namespace rayvox;

namespace {

struct Mesh {
  std::vector<double> vertices;
  std::vector<std::int32_t> triangles;

  operator TriangleMeshView() const { return {vertices, triangles}; }
};

// Random triangles, among them needles, lines and points.
Mesh soup(std::mt19937& random, std::size_t count) {
  std::uniform_real_distribution<double> place(-1, 1);
  std::uniform_int_distribution<int> kind(0, 5);
  Mesh mesh;
  for (std::size_t t = 0; t < count; ++t) {
    const double x = place(random), y = place(random), z = place(random);
    const int what = kind(random);
    for (int k = 0; k < 3; ++k) {
      const double size = what == 0 ? 0 : what == 1 ? 0.2 * k : 0.2 * place(random);
      const double across = what == 2 ? 1e-9 : 1;
      mesh.vertices.insert(mesh.vertices.end(),
                           {x + size, y + (what < 2 ? size : across * 0.2 * place(random)), z + across * size});
      mesh.triangles.push_back(static_cast<std::int32_t>(3 * t) + k);
    }
  }
  return mesh;
}

Mesh cube() {
  return {{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1},
          {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5}};
}

Vec3d random_point(std::mt19937& random, double reach = 1.5) {
  std::uniform_real_distribution<double> place(-reach, reach);
  return {place(random), place(random), place(random)};
}

// The distance of segment and triangle from above, by points along the segment.
double sampled_distance(const Triangle& triangle, const Vec3d& from, const Vec3d& to) {
  double best = INFINITY;
  for (int i = 0; i <= 64; ++i) best = std::min(best, squared_distance(triangle, from + (to - from) * (i / 64.0)));
  return std::sqrt(best);
}

}  // namespace

FACT(the_nearest_triangle_is_the_nearest_of_all) {
  std::mt19937 random(1);
  for (std::size_t count : {1u, 4u, 5u, 37u, 1000u}) {
    const Mesh mesh = soup(random, count);
    const TriangleMeshView view = mesh;
    const TriangleTree tree(mesh);
    for (int i = 0; i < 200; ++i) {
      const Vec3d p = random_point(random);
      double best = INFINITY;
      for (std::size_t t = 0; t < count; ++t) best = std::min(best, squared_distance(view.triangle(t), p));
      const TriangleTree::Nearest found = tree.nearest(p);
      CHECK_EQUAL(found.distance, std::sqrt(best));
      CHECK_EQUAL(std::sqrt(squared_distance(tree.triangle(found.triangle), p)), found.distance);
      CHECK(tree.touches(p, found.distance * (1 + 1e-12)) && !tree.touches(p, found.distance * 0.999));
      CHECK(!std::isfinite(tree.nearest(p, found.distance * 0.999).distance));
      CHECK_EQUAL(tree.nearest(p, found.distance * 1.001 + 1e-12).distance, found.distance);
    }
  }
}

FACT(a_segment_touches_what_its_nearest_point_touches) {
  std::mt19937 random(2);
  const Mesh mesh = soup(random, 300);
  const TriangleMeshView view = mesh;
  const TriangleTree tree(mesh);
  for (int i = 0; i < 300; ++i) {
    const Vec3d from = random_point(random), to = i % 3 ? random_point(random) : from + Vec3d{0, 0, i % 2 ? 0.0 : 2.0};
    double exact = INFINITY;
    for (std::size_t t = 0; t < 300; ++t) {
      const double distance = std::sqrt(squared_distance(view.triangle(t), from, to));
      CHECK(distance <= sampled_distance(view.triangle(t), from, to) + 1e-12);
      CHECK(distance + norm(to - from) / 64 >= sampled_distance(view.triangle(t), from, to) - 1e-12);
      exact = std::min(exact, distance);
    }
    CHECK(tree.touches(from, to, exact + 1e-12));
    if (exact > 0) CHECK(!tree.touches(from, to, exact * 0.999));
  }
}

FACT(inside_of_a_cube_is_inside_of_its_bounds) {
  const TriangleTree tree(cube());
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    Vec3d p = random_point(random, 2);
    // On the lines through corners, edges and the diagonals of the faces crossings are ambiguous one by one.
    if (i % 2) p = {p.x, i % 4 == 1 ? 0.5 : 1.0, i % 8 < 4 ? 0.5 : 0.0};
    const bool inside = p.x > 0 && p.x < 1 && p.y > 0 && p.y < 1 && p.z > 0 && p.z < 1;
    if (tree.nearest(p).distance > 1e-9) CHECK(tree.inside(p) == inside);
  }
}

FACT(parts_that_touch_along_an_edge_stay_apart) {
  Mesh mesh = cube();
  const Mesh other = cube();
  for (std::size_t i = 0; i < other.vertices.size(); i += 3) {
    mesh.vertices.insert(mesh.vertices.end(),
                         {other.vertices[i] + 1, other.vertices[i + 1] + 1, other.vertices[i + 2]});
  }
  for (const std::int32_t i : other.triangles) mesh.triangles.push_back(i + 8);
  const MeshParts parts = find_parts(mesh);
  CHECK_EQUAL(parts.closed.size(), std::size_t{2});
  CHECK(parts.closed[0] == 1 && parts.closed[1] == 1);
  CHECK(parts.part.front() != parts.part.back());
}

FACT(meshes_that_are_none_are_refused) {
  Mesh mesh = cube();
  mesh.triangles[5] = 8;
  CHECK_THROWS(InvalidInput, TriangleTree(mesh));
  mesh.triangles[5] = -1;
  CHECK_THROWS(InvalidInput, find_parts(mesh));
  mesh = cube();
  mesh.vertices[4] = NAN;
  CHECK_THROWS(InvalidInput, TriangleTree(mesh));
  CHECK_THROWS(InvalidInput, TriangleTree(Mesh{}));
}

FACT(a_surface_deviates_from_itself_by_nothing_and_from_another_by_the_farthest_point) {
  std::mt19937 random(4);
  for (int round = 0; round < 10; ++round) {
    const Mesh original = soup(random, 50), other = soup(random, 50);
    const TriangleMeshView view = original;
    const TriangleTree onto_itself(original), onto_other(other);
    CHECK_EQUAL(surface_deviation(original, onto_itself, 1e-6), 0.0);
    const double bound = surface_deviation(original, onto_other, 10);
    double sampled = 0;
    for (std::size_t t = 0; t < 50; ++t) {
      const auto [a, b, c] = view.triangle(t);
      for (int i = 0; i <= 8; ++i) {
        for (int j = 0; i + j <= 8; ++j) {
          sampled = std::max(sampled, onto_other.nearest(a + (b - a) * (i / 8.0) + (c - a) * (j / 8.0)).distance);
        }
      }
    }
    CHECK(bound >= sampled - 1e-12);
    CHECK(bound <= sampled + 1.2);  // a tenth of the limit, and what the samples miss
    CHECK(!std::isfinite(surface_deviation(original, onto_other, sampled * 0.99)));
    const double tight = surface_deviation(original, onto_other, bound);
    CHECK(tight >= sampled - 1e-12 && tight <= bound * (1 + 1e-9));
  }
}
