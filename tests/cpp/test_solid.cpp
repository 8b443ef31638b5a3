#include "rayvox/collision/solid.hpp"

#include "check.hpp"
#include "collision_meshes.hpp"
#include "rayvox/collision/collide.hpp"

using namespace rayvox;
using namespace collision_meshes;

namespace {

Soup box(double half, bool outward = true) {
  Soup soup;
  add_box(soup, {-half, -half, -half}, {half, half, half}, outward);
  return soup;
}

int state(const Soup& a, const Soup& b, const Matrix& pose, bool solids = true) {
  return collide(KdopBvh(a.mesh(), {}), KdopBvh(b.mesh(), {}), pose, {.solids = solids}).state[0];
}

}  // namespace

FACT(a_point_is_inside_a_sphere_where_its_distance_says_so) {
  std::mt19937_64 random(1);
  const KdopBvh bvh(sphere(60, 80).mesh(), {});
  const Solid solid(bvh);
  CHECK(solid.exists());
  for (int i = 0; i < 3000; ++i) {
    const Vec3d p = point(random, 1.1);
    if (std::abs(norm(p) - 1) < 5e-3) continue;  // between the facets and the sphere
    CHECK_EQUAL(solid.contains(p), norm(p) < 1);
  }
  CHECK(solid.contains({0, 0, 0}));  // rays to the poles and through every edge of the equator
}

FACT(a_box_inside_a_box_collides_unless_surfaces_alone_are_asked_for) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 50; ++i) {
    const Matrix pose = random_pose(random, 0.3);
    CHECK_EQUAL(state(box(1), box(0.2), pose), 2);
    CHECK_EQUAL(state(box(0.2), box(1), pose), 2);
    CHECK_EQUAL(state(box(1, false), box(0.2), pose), 2);  // inside out is a solid too
    CHECK_EQUAL(state(box(1), box(0.2), pose, false), 0);
  }
  CHECK_EQUAL(state(box(1), box(0.2), translated({1.5, 0, 0})), 0);
}

FACT(an_open_box_contains_nothing) {
  Soup open = box(1);
  open.triangles.resize(open.triangles.size() - 3);
  CHECK(!open.mesh()->is_closed());
  CHECK_EQUAL(state(open, box(0.2), identity()), 0);
  CHECK_EQUAL(state(box(0.2), open, identity()), 0);
  CHECK_EQUAL(state(box(2), open, identity()), 2);  // an open surface inside a solid collides
}

FACT(a_part_in_the_wall_or_the_void_of_a_hollow_box_is_inside) {
  Soup shell = box(1);
  add_box(shell, {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, false);
  CHECK(shell.mesh()->is_closed());
  CHECK_EQUAL(static_cast<int>(shell.mesh()->components().size()), 2);
  CHECK_EQUAL(state(shell, box(0.1), translated({0.75, 0, 0})), 2);
  // The void counts as inside: each closed surface bounds a solid of its own, whatever is nested in it. Nothing gets in
  // there without passing the wall.
  CHECK_EQUAL(state(shell, box(0.1), identity()), 2);
}

FACT(each_component_of_a_mesh_is_looked_at) {
  Soup two = box(0.1);
  add_box(two, {4.9, -0.1, -0.1}, {5.1, 0.1, 0.1});
  CHECK_EQUAL(state(box(1), two, identity()), 2);
  CHECK_EQUAL(state(box(1), two, translated({-5, 0, 0})), 2);
  CHECK_EQUAL(state(box(1), two, translated({-2.5, 0, 0})), 0);
  CHECK_EQUAL(state(two, box(1), translated({5, 0, 0})), 2);
}

FACT(triangles_turned_at_random_still_bound_a_solid) {
  std::mt19937_64 random(3);
  Soup mixed = sphere(10, 12);
  for (std::size_t t = 0; t < mixed.triangles.size(); t += 3) {
    if (random() % 2) std::swap(mixed.triangles[t], mixed.triangles[t + 1]);
  }
  const auto mesh = mixed.mesh();
  CHECK(mesh->components()[0].kind == MeshComponent::Kind::even);
  CHECK_EQUAL(state(mixed, box(0.2), identity()), 2);
  CHECK_EQUAL(state(mixed, box(0.2), translated({1.5, 0, 0})), 0);
}

FACT(triangles_without_area_neither_open_nor_close_a_mesh) {
  Soup soup = box(1);
  soup.add({1, 1, 1}, {1, 1, 1}, {-1, 1, 1});
  CHECK(soup.mesh()->is_closed());
  Soup point_only;
  point_only.add({0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  CHECK(!point_only.mesh()->is_closed());
}
