#include "rayvox/map_collision/interior_grid.hpp"

#include "check.hpp"
#include "collision_meshes.hpp"
#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/geometry/triangle_distance.hpp"

using namespace rayvox;
using namespace collision_meshes;

namespace {

// A ball, a box that overlaps it, a thin plate and an open triangle.
Soup parts(double scale) {
  Soup soup = sphere(12, 16, 0.5);
  add_box(soup, {0.2, 0.1, -0.2}, {1.3, 0.4, 0.3});
  add_box(soup, {-1.2, -1, 0.4}, {1, 0.9, 0.42});
  soup.add({-2, -2, -2}, {2, -2, -2}, {0, 2, 2});
  soup.transform(scale, {0.1 * scale, 0, 0});
  return soup;
}

double distance_to_closed_parts(const CollisionMesh& mesh, const Vec3d& p) {
  double least = 1e30;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    if (mesh.components()[mesh.component_of(t)].kind == MeshComponent::Kind::open) continue;
    least = std::min(least, std::sqrt(squared_distance(mesh.triangle(t), p)));
  }
  return least;
}

}  // namespace

FACT(the_side_of_a_point_clear_of_the_surface_is_that_of_its_exact_test) {
  std::mt19937_64 random(1);
  for (const double scale : {1e-3, 1.0, 50.0}) {
    const Soup soup = parts(scale);
    const KdopBvh bvh(soup.mesh(), {});
    const Solid solid(bvh);
    const InteriorGrid grid(bvh.mesh(), solid);
    int sides[3] = {};
    for (int i = 0; i < 3000; ++i) {
      const Vec3d p = point(random, 1.3 * scale);
      const double clear_m = distance_to_closed_parts(bvh.mesh(), p) * uniform(random, 0.5, 1);
      const InteriorGrid::Side side = grid.side(p, clear_m);
      ++sides[static_cast<int>(side)];
      if (side != InteriorGrid::Side::undecided) CHECK_EQUAL(side == InteriorGrid::Side::inside, solid.contains(p));
    }
    CHECK(sides[0] > 1500 && sides[1] > 60 && sides[2] < 400);
  }
}

FACT(no_point_inside_is_missed_within_a_radius) {
  std::mt19937_64 random(2);
  const KdopBvh bvh(parts(1).mesh(), {});
  const Solid solid(bvh);
  const InteriorGrid grid(bvh.mesh(), solid);
  int held = 0, missing = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3d p = point(random, 2.5);
    const double radius_m = uniform(random, 0.01, 0.6);
    const Vec3d q = p + point(random, radius_m);
    const double clear_m = distance_to_closed_parts(bvh.mesh(), q);
    const bool may = grid.may_hold_inside(p, radius_m, clear_m);
    if (solid.contains(q)) CHECK(may);
    ++(may ? held : missing);
  }
  CHECK(held > 300 && missing > 300);
}

FACT(an_open_mesh_has_no_inside) {
  Soup open;
  open.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const KdopBvh bvh(open.mesh(), {});
  const InteriorGrid grid(bvh.mesh(), Solid(bvh));
  CHECK(!grid.may_hold_inside({0, 0, 0}, 10, 0));
  CHECK(grid.side({0, 0, 0}, 0) == InteriorGrid::Side::outside);
}
