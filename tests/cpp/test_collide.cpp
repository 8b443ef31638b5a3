#include "rayvox/collision/collide.hpp"

#include <algorithm>

#include "check.hpp"
#include "collision_meshes.hpp"
#include "rayvox/collision/relative_placement.hpp"
#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"

using namespace rayvox;
using namespace collision_meshes;

namespace {

const CollisionKernels* const all_sets[] = {collision_kernels_for("portable"), collision_kernels_for("avx2"),
                                            collision_kernels_for("avx512")};

struct Variant {
  Traversal traversal;
  int branching_factor;
};
const Variant all_variants[] = {{Traversal::scalar, 2},
                                {Traversal::scalar, 16},
                                {Traversal::simd_orientations, 2},
                                {Traversal::simd_orientations, 4},
                                {Traversal::one_vs_sixteen, 4},
                                {Traversal::one_vs_sixteen, 16},
                                {Traversal::four_vs_four, 4},
                                {Traversal::hybrid, 8},
                                {Traversal::hybrid, 16}};

// Every pair of triangles, at the placement that the queries use.
std::vector<Contact> brute_force(const CollisionMesh& a, const CollisionMesh& b, const std::vector<double>& poses) {
  const auto share = [](const CollisionMesh& mesh) {
    return std::shared_ptr<const CollisionMesh>(&mesh, [](auto*) {});
  };
  const KdopBvh bvh_a(share(a), {}), bvh_b(share(b), {});
  const PairTables tables(bvh_a, bvh_b, collision_kernels());
  std::vector<Contact> contacts;
  for (std::uint32_t i = 0; i < poses.size() / 16; ++i) {
    const auto placement = tables.place(RigidTransform::from_matrix(poses.data() + 16 * i));
    if (!placement) continue;
    for (std::uint32_t s = 0; s < a.triangle_count(); ++s) {
      for (std::uint32_t t = 0; t < b.triangle_count(); ++t) {
        Triangle moved = b.triangle(t);
        for (Vec3d& corner : moved) corner = placement->apply(corner);
        if (triangles_touch(a.triangle(s), moved)) contacts.push_back({i, s, t});
      }
    }
  }
  return contacts;
}

std::vector<double> random_poses(std::mt19937_64& random, int count, double reach) {
  std::vector<double> poses;
  for (int i = 0; i < count; ++i) {
    const Matrix m = i == 0 ? identity() : random_pose(random, reach);
    poses.insert(poses.end(), m.begin(), m.end());
  }
  return poses;
}

void check_every_variant(const Soup& soup_a, const Soup& soup_b, const std::vector<double>& poses,
                         std::mt19937_64& random) {
  const auto a = soup_a.mesh(), b = soup_b.mesh();
  const std::vector<Contact> expected = brute_force(*a, *b, poses);
  std::vector<std::uint8_t> touched(poses.size() / 16);
  for (const Contact& contact : expected) touched[contact.pose] = CollideResult::surfaces_touch;
  for (const Variant& variant : all_variants) {
    for (const SlabFormat slabs : {SlabFormat::float32, SlabFormat::float16}) {
      const BvhOptions options{.axes = KdopAxes::standard(std::array{6, 8, 14, 16, 18, 24, 26, 32}[random() % 8]),
                               .branching_factor = variant.branching_factor,
                               .slabs = slabs,
                               .traversal = variant.traversal,
                               .leaf_size = std::array{1, 3, 16}[random() % 3]};
      const KdopBvh bvh_a(a, options), bvh_b(b, options);
      for (const CollisionKernels* set : all_sets) {
        if (!set) continue;
        CollideOptions query{.contacts = Contacts::all, .solids = false, .kernels = set};
        CollideResult all = collide(bvh_a, bvh_b, poses, query);
        CHECK(all.contacts == expected);
        CHECK(all.state == touched);
        query.contacts = Contacts::first;
        const CollideResult first = collide(bvh_a, bvh_b, poses, query);
        CHECK(first.state == touched);
        CHECK_EQUAL(static_cast<long>(first.contacts.size()), std::count(touched.begin(), touched.end(), 1));
        for (const Contact& contact : first.contacts)
          CHECK(std::find(expected.begin(), expected.end(), contact) != expected.end());
        query.contacts = Contacts::none;
        CHECK(collide(bvh_a, bvh_b, poses, query).state == touched);
      }
    }
  }
}

}  // namespace

FACT(every_variant_finds_exactly_the_contacts_of_brute_force) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 14; ++round) {
    const int most = 1 + round * 9;
    const Soup a = random_soup(random, 1 + static_cast<int>(random() % static_cast<unsigned>(most)));
    const Soup b = random_soup(random, 1 + static_cast<int>(random() % static_cast<unsigned>(most)));
    check_every_variant(a, b, random_poses(random, 12, 1.2), random);
  }
}

FACT(far_tiny_and_huge_meshes_lose_nothing) {
  std::mt19937_64 random(2);
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e6}) {
      if (scale < 1 && offset > 0) continue;  // float64 cannot hold such vertices
      Soup a = random_soup(random, 40), b = random_soup(random, 40);
      a.transform(scale, {offset, 0, -offset});
      b.transform(scale, {0, offset, offset});
      std::vector<double> poses;
      for (int i = 0; i < 10; ++i) {
        // b's centre, wherever it is, comes to within reach of a's.
        Matrix m = random_pose(random, scale);
        const Vec3d centre_b = b.mesh()->centre_m(), centre_a = a.mesh()->centre_m();
        for (std::size_t r = 0; r < 3; ++r) {
          m[4 * r + 3] += centre_a[static_cast<int>(r)] -
                          (m[4 * r] * centre_b.x + m[4 * r + 1] * centre_b.y + m[4 * r + 2] * centre_b.z);
        }
        poses.insert(poses.end(), m.begin(), m.end());
      }
      check_every_variant(a, b, poses, random);
    }
  }
}

FACT(a_mesh_collides_with_itself_at_the_identity) {
  std::mt19937_64 random(3);
  const Soup soup = random_soup(random, 60);
  check_every_variant(soup, soup, random_poses(random, 1, 0), random);
}

FACT(a_pose_rounded_to_float32_is_taken_as_it_is) {
  std::mt19937_64 random(4);
  std::vector<double> poses = random_poses(random, 12, 1.0);
  for (double& value : poses) value = static_cast<float>(value);
  check_every_variant(random_soup(random, 60), random_soup(random, 60), poses, random);
}

FACT(boxes_a_billionth_apart_are_told_from_boxes_that_touch_even_a_million_metres_out) {
  for (const double far : {0.0, 0x1p20}) {
    Soup box_a, box_b;
    add_box(box_a, {far, far, far}, {far + 1, far + 1, far + 1});
    add_box(box_b, {-far, far, 0}, {-far + 1, far + 1, 1});
    const auto a = box_a.mesh(), b = box_b.mesh();
    for (const Variant& variant : all_variants) {
      const BvhOptions options{
          .branching_factor = variant.branching_factor, .traversal = variant.traversal, .leaf_size = 2};
      const KdopBvh bvh_a(a, options), bvh_b(b, options);
      for (const double gap : {0x1p-30, 0.0, -0x1p-30}) {
        // A face on a face, an edge on an edge, a corner on a corner.
        for (const Vec3d& side : {Vec3d{1, 0.25, 0.375}, Vec3d{1, 1, 0.375}, Vec3d{1, 1, 1}}) {
          const Vec3d t{2 * far + side.x + gap, side.y, far + side.z};
          const Matrix pose = translated(t);
          const CollideResult result = collide(bvh_a, bvh_b, pose, {.solids = false});
          CHECK_EQUAL(int{result.state[0]}, gap <= 0 ? 1 : 0);
        }
      }
    }
  }
}

FACT(needles_of_aspect_1e8_are_not_lost) {
  std::mt19937_64 random(5);
  Soup a, b;
  for (int i = 0; i < 30; ++i) {
    const Vec3d p = point(random, 0.3), d = point(random);
    a.add(p - d, p + d, p + d + point(random, 1e-8));
    const Vec3d q = point(random, 0.3), e = point(random);
    b.add(q - e, q + e, q + point(random, 0.4));
  }
  check_every_variant(a, b, random_poses(random, 8, 0.3), random);
}

FACT(answers_do_not_depend_on_the_number_of_threads) {
  std::mt19937_64 random(6);
  const KdopBvh a(random_soup(random, 300).mesh(), {}), b(random_soup(random, 300).mesh(), {});
  const std::vector<double> poses = random_poses(random, 500, 1.5);
  set_thread_count(1);
  const CollideResult one = collide(a, b, poses, {.contacts = Contacts::all, .statistics = true});
  set_thread_count(4);
  const CollideResult four = collide(a, b, poses, {.contacts = Contacts::all, .statistics = true});
  CHECK(one.state == four.state);
  CHECK(one.contacts == four.contacts);
  CHECK(one.contacts.size() > 100);
  CHECK_EQUAL(one.statistics.size(), poses.size() / 16);
  for (std::size_t i = 0; i < one.statistics.size(); ++i) {
    CHECK_EQUAL(one.statistics[i].node_pairs, four.statistics[i].node_pairs);
    CHECK(one.state[i] == 0 || one.statistics[i].triangle_pairs > 0);
  }
}

FACT(poses_that_are_not_rigid_are_named) {
  std::mt19937_64 random(7);
  const KdopBvh a(random_soup(random, 5).mesh(), {});
  std::vector<double> poses = random_poses(random, 3, 1);
  poses[16] *= 2;
  try {
    collide(a, a, poses, {});
    CHECK(false);
  } catch (const InvalidInput& error) {
    CHECK(std::string(error.what()).find("T_a_b[1]") != std::string::npos);
  }
}

FACT(hierarchies_built_differently_are_refused) {
  std::mt19937_64 random(8);
  const auto mesh = random_soup(random, 5).mesh();
  const BvhOptions wide{.traversal = Traversal::one_vs_sixteen};
  BvhOptions other_axes = wide, other_slabs = wide;
  other_axes.axes = KdopAxes::standard(14);
  other_slabs.slabs = SlabFormat::float32;
  const Matrix pose = identity();
  for (const BvhOptions& options : {BvhOptions{}, other_axes, other_slabs}) {
    CHECK_THROWS(InvalidInput, collide(KdopBvh(mesh, wide), KdopBvh(mesh, options), pose, {}));
  }
}
