// Every traversal, k, slab width, branching factor, construction and instruction set against brute force, on ten
// thousand random and nearly touching placements and on two thousand that touch exactly or not at all.
#include <algorithm>
#include <string>

#include "check.hpp"
#include "collision_meshes.hpp"
#include "integer_triangles.hpp"
#include "rayvox/collision/collide.hpp"
#include "triangle_gap.hpp"

using namespace rayvox;
using namespace collision_meshes;

namespace {

const CollisionKernels* const all_sets[] = {collision_kernels_for("portable"), collision_kernels_for("avx2"),
                                            collision_kernels_for("avx512")};
constexpr int every_k[] = {6, 8, 14, 16, 18, 24, 26, 32};
constexpr SlabFormat every_width[] = {SlabFormat::float32, SlabFormat::float16};
constexpr Traversal every_traversal[] = {Traversal::scalar, Traversal::simd_orientations, Traversal::one_vs_sixteen,
                                         Traversal::four_vs_four, Traversal::hybrid};

struct Shape {
  int branching_factor;
  Construction construction;
};

// All branching factors and constructions that go together.
std::vector<Shape> shapes_of(Traversal traversal) {
  std::vector<Shape> shapes;
  for (const int b : {2, 4, 8, 16}) {
    if (traversal == Traversal::four_vs_four && b != 4) continue;
    for (const Construction c :
         {Construction::longest_axis, Construction::extended_longest_axis, Construction::batch_neural_gas})
      shapes.push_back({b, c});
    if (b == 2) shapes.push_back({b, Construction::surface_area_heuristic});
  }
  return shapes;
}

// Two meshes, placements of the second, and which of them collide: 1, 0, or nearer to touching than `undecided`.
struct Configurations {
  static constexpr std::int8_t undecided = -1;

  std::shared_ptr<const CollisionMesh> a, b;
  std::vector<double> poses;
  std::vector<std::int8_t> touching;
};

std::string described(const BvhOptions& o, const CollisionKernels& set) {
  return "traversal " + std::to_string(static_cast<int>(o.traversal)) + ", k " + std::to_string(o.axes.k()) +
         (o.slabs == SlabFormat::float16 ? ", float16" : ", float32") + ", branching " +
         std::to_string(o.branching_factor) + ", construction " + std::to_string(static_cast<int>(o.construction)) +
         ", " + set.instruction_set;
}

void check_verdicts(const Configurations& c, const BvhOptions& options) {
  const KdopBvh bvh_a(c.a, options), bvh_b(c.b, options);
  for (const CollisionKernels* set : all_sets) {
    if (!set) continue;
    const CollideResult found = collide(bvh_a, bvh_b, c.poses, {.solids = false, .kernels = set});
    for (std::size_t i = 0; i < found.state.size(); ++i) {
      if (c.touching[i] == Configurations::undecided || c.touching[i] == found.state[i]) continue;
      check::fail(__FILE__, __LINE__, "pose " + std::to_string(i) + " wrong: " + described(options, *set));
    }
  }
}

// Each traversal with each k and slab width; shapes and leaf sizes in turn.
void check_every_volume(const Configurations& configurations, std::size_t turn) {
  for (const Traversal traversal : every_traversal) {
    const std::vector<Shape> shapes = shapes_of(traversal);
    for (const int k : every_k) {
      for (const SlabFormat width : every_width) {
        const Shape& shape = shapes[turn++ % shapes.size()];
        check_verdicts(configurations, {.axes = KdopAxes::standard(k),
                                        .branching_factor = shape.branching_factor,
                                        .construction = shape.construction,
                                        .slabs = width,
                                        .traversal = traversal,
                                        .leaf_size = std::array{1, 2, 5, 16}[turn % 4]});
      }
    }
  }
}

// A point of one of a soup's triangles.
Vec3d point_on(const Soup& soup, std::mt19937_64& random) {
  const std::size_t t = 3 * (random() % (soup.triangles.size() / 3));
  const double s = uniform(random, 0, 1), r = uniform(random, 0, 1 - s);
  const auto corner = [&](std::size_t i) {
    const double* p = &soup.vertices[3 * static_cast<std::size_t>(soup.triangles[t + i])];
    return Vec3d{p[0], p[1], p[2]};
  };
  return corner(0) * (1 - s - r) + corner(1) * s + corner(2) * r;
}

Matrix moved(Matrix pose, const Vec3d& by) {
  for (int i = 0; i < 3; ++i) pose[static_cast<std::size_t>(4 * i + 3)] += by[i];
  return pose;
}

// A random rotation and the translation that brings two points of the surfaces together.
Matrix crossing_pose(const Soup& a, const Soup& b, std::mt19937_64& random) {
  const Matrix pose = random_pose(random, 0);
  const Vec3d p = point_on(b, random), at = point_on(a, random);
  return moved(pose,
               at - Vec3d{pose[0] * p.x + pose[1] * p.y + pose[2] * p.z, pose[4] * p.x + pose[5] * p.y + pose[6] * p.z,
                          pose[8] * p.x + pose[9] * p.y + pose[10] * p.z});
}

// How far b must go along a direction from a pose that collides to within rounding of touching.
double distance_to_touch(const Matrix& pose, const Vec3d& direction, const KdopBvh& a, const KdopBvh& b) {
  double inside = 0, outside = 4;
  for (int i = 0; i < 48; ++i) {
    const double middle = (inside + outside) / 2;
    (collide(a, b, moved(pose, direction * middle), {.solids = false}).state[0] ? inside : outside) = middle;
  }
  return outside;
}

Configurations near_touching(std::mt19937_64& random, int count, int most_triangles) {
  const auto soup = [&] {
    return random_soup(random, 1 + static_cast<int>(random() % static_cast<unsigned>(most_triangles)));
  };
  const Soup a = soup(), b = soup();
  Configurations c{a.mesh(), b.mesh(), {}, {}};
  const KdopBvh bvh_a(c.a, {}), bvh_b(c.b, {});
  const double offsets[] = {-1e-6, -1e-8, -2e-9, 2e-9, 1e-8, 1e-6, -1e-3, 1e-3, 0};
  for (int i = 0; i < count; ++i) {
    Matrix pose = crossing_pose(a, b, random);
    const Vec3d aside = point(random, 1.0), direction = aside * (1 / norm(aside));
    if (i % 2) {
      const double offset = offsets[static_cast<std::size_t>(i / 2 % 9)];
      pose = moved(pose, direction * (distance_to_touch(pose, direction, bvh_a, bvh_b) + offset));
    } else {
      pose = moved(pose, aside * 0.5);
    }
    c.poses.insert(c.poses.end(), pose.begin(), pose.end());
    const auto gap = triangle_gap::least_gap(a, b, pose, 1e-6L);
    c.touching.push_back(std::abs(gap) < 1e-9L ? Configurations::undecided : gap <= 0);
  }
  return c;
}

// Corners on a grid, quarter turns and whole translations: placed without rounding, and touching exactly where they do.
Configurations on_a_grid(std::mt19937_64& random, int count) {
  using namespace integer_triangles;
  const auto number = [&](long most) {
    return static_cast<long>(random() % static_cast<unsigned long>(2 * most + 1)) - most;
  };
  std::vector<IntegerTriangle> a(1 + random() % 12), b(1 + random() % 12);
  Soup soup_a, soup_b;
  for (auto* soup : {&soup_a, &soup_b}) {
    for (IntegerTriangle& t : soup == &soup_a ? a : b) {
      const Integer3 at{number(4), number(4), number(4)};
      for (Integer3& p : t) p = {at.x + number(2), at.y + number(2), at.z + number(2)};
      const auto real = [](const Integer3& p) { return Vec3d{double(p.x), double(p.y), double(p.z)}; };
      soup->add(real(t[0]), real(t[1]), real(t[2]));
    }
  }
  Configurations c{soup_a.mesh(), soup_b.mesh(), {}, {}};
  const long turns[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  for (int i = 0; i < count; ++i) {
    const auto [cosine, sine] = turns[random() % 4];
    const Integer3 t{number(6), number(6), number(6)};
    const Matrix pose{double(cosine),
                      double(-sine),
                      0,
                      double(t.x),
                      double(sine),
                      double(cosine),
                      0,
                      double(t.y),
                      0,
                      0,
                      1,
                      double(t.z),
                      0,
                      0,
                      0,
                      1};
    c.poses.insert(c.poses.end(), pose.begin(), pose.end());
    bool touching = false;
    for (IntegerTriangle moved : b) {
      for (Integer3& p : moved) p = {cosine * p.x - sine * p.y + t.x, sine * p.x + cosine * p.y + t.y, p.z + t.z};
      touching = touching || std::any_of(a.begin(), a.end(), [&](const auto& s) { return touch_by_axes(s, moved); });
    }
    c.touching.push_back(touching);
  }
  return c;
}

struct Tally {
  long apart = 0, touching = 0;
  void add(const Configurations& c) {
    apart += std::count(c.touching.begin(), c.touching.end(), 0);
    touching += std::count(c.touching.begin(), c.touching.end(), 1);
  }
};

}  // namespace

FACT(no_traversal_k_or_slab_width_errs_at_ten_thousand_random_and_touching_placements) {
  std::mt19937_64 random(1);
  Tally tally;
  for (std::size_t pair = 0; pair < 20; ++pair) {
    const Configurations c = near_touching(random, 500, 1 + static_cast<int>(pair) * 2);
    tally.add(c);
    check_every_volume(c, pair);
  }
  CHECK(tally.apart > 3000 && tally.touching > 2000);
}

FACT(no_traversal_k_or_slab_width_errs_where_triangles_touch_exactly) {
  std::mt19937_64 random(2);
  Tally tally;
  for (std::size_t pair = 0; pair < 20; ++pair) {
    const Configurations c = on_a_grid(random, 100);
    tally.add(c);
    check_every_volume(c, pair);
  }
  CHECK(tally.apart > 500 && tally.touching > 400);
}

FACT(no_branching_factor_or_construction_errs_with_any_volume) {
  std::mt19937_64 random(3);
  const Configurations c = near_touching(random, 600, 60);
  for (const Traversal traversal : every_traversal) {
    for (const Shape& shape : shapes_of(traversal)) {
      for (const int k : every_k) {
        for (const SlabFormat width : every_width) {
          check_verdicts(c, {.axes = KdopAxes::standard(k),
                             .branching_factor = shape.branching_factor,
                             .construction = shape.construction,
                             .slabs = width,
                             .traversal = traversal,
                             .leaf_size = 2});
        }
      }
    }
  }
}
