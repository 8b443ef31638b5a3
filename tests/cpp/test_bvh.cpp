#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "check.hpp"
#include "collision_meshes.hpp"
#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/simd/collision_kernels.hpp"

using namespace rayvox;
using namespace collision_meshes;

namespace {

double support_of(const Triangle& t, const Vec3d& d) {
  double most = -INFINITY;
  for (const Vec3d& p : t) most = std::max(most, p.x * d.x + p.y * d.y + p.z * d.z);
  return most;
}

bool in_box(const BvhNode& node, const Vec3d& p) {
  for (std::size_t i = 0; i < 3; ++i) {
    double along = 0;
    for (std::size_t c = 0; c < 3; ++c)
      along += box_axis(node, static_cast<int>(i))[static_cast<int>(c)] * (p[static_cast<int>(c)] - node.origin[c]);
    if (std::abs(along) > node.box_half[i]) return false;
  }
  return true;
}

void collect(const KdopBvh& bvh, std::size_t index, std::vector<std::uint32_t>& triangles) {
  const BvhNode& node = bvh.nodes()[index];
  for (std::uint32_t i = 0; i < node.count; ++i) {
    if (node.is_leaf)
      triangles.push_back(bvh.triangle_at(node.first + i));
    else
      collect(bvh, node.first + i, triangles);
  }
}

// That `supports` enclose the triangles below a node and not more: wrapped, not layered.
void check_supports(const KdopBvh& bvh, const std::vector<double>& supports, std::size_t below, double unit) {
  std::vector<std::uint32_t> triangles;
  collect(bvh, below, triangles);
  // Half floats lose 2^-10 of what they are relative to; integers are in a 32767th of the mesh's radius.
  const double integer = bvh.view().slabs_i16.own ? 3.06e-5 * bvh.mesh().radius_m() : 0;
  const double half = bvh.view().slabs_f16.own ? 2.5e-3 * unit : integer;
  for (int o = 0; o < bvh.options().axes.k(); ++o) {
    double most = -INFINITY;
    for (const std::uint32_t t : triangles) {
      most = std::max(most, support_of(bvh.mesh().triangle(t), bvh.options().axes.orientation(o)));
    }
    CHECK(supports[static_cast<std::size_t>(o)] >= most);
    CHECK(supports[static_cast<std::size_t>(o)] <= most + 4e-6 * bvh.mesh().radius_m() + 1e-11 + half);
  }
}

void check_bvh(const KdopBvh& bvh) {
  std::vector<int> seen(bvh.mesh().triangle_count());
  for (std::size_t index = 0; index < bvh.nodes().size(); ++index) {
    const BvhNode& node = bvh.nodes()[index];
    check_supports(bvh, bvh.supports(index), index, node.radius);
    if (node.is_leaf) {
      CHECK(node.count >= 1 && node.count <= bvh.options().leaf_size);
      for (std::uint32_t i = 0; i < node.count; ++i) ++seen[bvh.triangle_at(node.first + i)];
    } else {
      CHECK(node.count >= 2 && node.count <= bvh.options().branching_factor);
      const bool has_rows = bvh.view().slabs_f16.child || bvh.view().slabs_f32.child;
      for (std::uint32_t i = 0; has_rows && i < node.count; ++i) {
        check_supports(bvh, bvh.block_supports(index, static_cast<int>(i)), node.first + i, node.radius);
      }
    }
    if (!bvh.view().has_boxes) continue;
    std::vector<std::uint32_t> triangles;
    collect(bvh, index, triangles);
    for (const std::uint32_t t : triangles) {
      for (const Vec3d& p : bvh.mesh().triangle(t)) CHECK(in_box(node, p));
    }
  }
  CHECK(std::all_of(seen.begin(), seen.end(), [](int times) { return times == 1; }));
}

const Construction all_constructions[] = {Construction::longest_axis, Construction::extended_longest_axis,
                                          Construction::batch_neural_gas, Construction::surface_area_heuristic};

}  // namespace

FACT(every_triangle_is_in_one_leaf_and_wrapped_by_every_ancestor) {
  std::mt19937_64 random(1);
  for (const Construction construction : all_constructions) {
    for (const int b : {2, 4, 8, 16}) {
      if (construction == Construction::surface_area_heuristic && b != 2) continue;
      for (const Traversal traversal : {Traversal::scalar, Traversal::one_vs_sixteen, Traversal::hybrid}) {
        for (const SlabFormat slabs : {SlabFormat::float32, SlabFormat::float16}) {
          const int k = std::array{6, 8, 14, 16, 18, 24, 26, 32}[random() % 8];
          check_bvh(KdopBvh(random_soup(random, 1 + static_cast<int>(random() % 150)).mesh(),
                            {.axes = KdopAxes::standard(k),
                             .branching_factor = b,
                             .construction = construction,
                             .slabs = slabs,
                             .traversal = traversal,
                             .leaf_size = 1 + static_cast<int>(random() % 16)}));
        }
      }
    }
  }
}

FACT(degenerate_meshes_build) {
  Soup same, point_only, line, plane;
  for (int i = 0; i < 500; ++i) {
    same.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    point_only.add({7, 7, 7}, {7, 7, 7}, {7, 7, 7});
    line.add({i * 1.0, 0, 0}, {i + 1.0, 0, 0}, {i + 2.0, 0, 0});
    plane.add({i % 20 * 1.0, i / 20 * 1.0, 3}, {i % 20 + 1.0, i / 20 * 1.0, 3}, {i % 20 * 1.0, i / 20 + 1.0, 3});
  }
  // All but a few centres coincide: no criterion makes progress on its own.
  Soup lopsided = same;
  lopsided.add({1e6, 0, 0}, {1e6, 1, 0}, {1e6, 0, 1});
  for (const Soup* soup : {&same, &point_only, &line, &plane, &lopsided}) {
    for (const Construction construction : all_constructions) {
      for (const int leaf_size : {1, 16}) {
        const int b = construction == Construction::surface_area_heuristic ? 2 : 4;
        const KdopBvh bvh(soup->mesh(), {.branching_factor = b, .construction = construction, .leaf_size = leaf_size});
        check_bvh(bvh);
        CHECK(bvh.depth() < 60);
      }
    }
  }
}

FACT(extreme_scales_and_offsets_build) {
  std::mt19937_64 random(2);
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e6}) {
      Soup soup = random_soup(random, 100);
      soup.transform(scale, {offset, -offset, offset});
      for (const SlabFormat slabs : {SlabFormat::float32, SlabFormat::float16})
        check_bvh(KdopBvh(soup.mesh(), {.slabs = slabs}));
    }
  }
}

FACT(the_tree_is_the_same_for_a_seed_whatever_the_thread_count) {
  std::mt19937_64 random(3);
  const auto mesh = random_soup(random, 20000, 0.02).mesh();
  std::vector<std::uint32_t> orders[3];
  for (const int threads : {1, 4}) {
    set_thread_count(threads);
    orders[threads == 4] = KdopBvh(mesh, {}).triangle_order();
  }
  orders[2] = KdopBvh(mesh, {.seed = 2}).triangle_order();
  CHECK(orders[0] == orders[1]);
  CHECK(orders[0] != orders[2]);
}

FACT(neural_gas_is_the_same_to_the_bit_in_every_instruction_set) {
  std::mt19937_64 random(5);
  for (int sample = 0; sample < 500; ++sample) {
    std::vector<PartitionItem> items(1 + random() % 100);
    // A coarse grid: many items and prototypes coincide or are as near as others.
    for (PartitionItem& item : items) {
      for (float& c : item.centre) c = 0.37f * static_cast<float>(random() % 4);
    }
    GasPrototypes start{};
    start.count = static_cast<int>(2 + random() % 15);
    alignas(64) float weight[GasPrototypes::most] = {};
    for (int i = 0; i < start.count; ++i) {
      weight[i] = std::exp(-0.7f * static_cast<float>(i));
      for (auto& row : start.at) row[i] = 0.37f * static_cast<float>(random() % 4);
    }
    const auto run = [&](const CollisionKernels& kernels, GasPrototypes gas) {
      for (int batch = 0; batch < 3; ++batch) {
        kernels.adapt_prototypes(gas, items.data(), items.size(), 1 + items.size() / 2, weight);
      }
      std::vector<std::uint8_t> nearest(items.size());
      kernels.nearest_prototypes(gas, items.data(), items.size(), nearest.data());
      return std::pair(gas, nearest);
    };
    const auto [expected, expected_nearest] = run(*collision_kernels_for("portable"), start);
    for (std::size_t i = 0; i < items.size(); ++i) {
      const auto squared = [&](int j) {
        float sum = 0;
        for (int c = 0; c < 3; ++c) {
          const float d = expected.at[c][j] - items[i].centre[c];
          sum += d * d;
        }
        return sum;
      };
      for (int j = 0; j < expected.count; ++j) CHECK(squared(expected_nearest[i]) <= squared(j));
    }
    for (const char* set : {"avx2", "avx512"}) {
      const CollisionKernels* kernels = collision_kernels_for(set);
      if (!kernels) continue;
      const auto [found, found_nearest] = run(*kernels, start);
      CHECK(found_nearest == expected_nearest);
      for (int c = 0; c < 3; ++c) CHECK(std::equal(found.at[c], found.at[c] + found.count, expected.at[c]));
    }
  }
}

FACT(options_that_do_not_fit_are_refused) {
  std::mt19937_64 random(4);
  const auto mesh = random_soup(random, 5).mesh();
  CHECK_THROWS(InvalidInput, KdopBvh(mesh, {.branching_factor = 3}));
  CHECK_THROWS(InvalidInput, KdopBvh(mesh, {.leaf_size = 0}));
  CHECK_THROWS(InvalidInput, KdopBvh(mesh, {.leaf_size = 17}));
  CHECK_THROWS(InvalidInput, KdopBvh(mesh, {.branching_factor = 16, .traversal = Traversal::four_vs_four}));
  CHECK_THROWS(InvalidInput,
               KdopBvh(mesh, {.branching_factor = 4, .construction = Construction::surface_area_heuristic}));
}

FACT(meshes_that_cannot_be_used_are_refused) {
  const std::vector<double> corners{0, 0, 0, 1, 0, 0, 0, 1, 0};
  const auto make = [&](std::vector<double> v, std::vector<std::int64_t> t) { return CollisionMesh(v, t); };
  CHECK_THROWS(InvalidInput, make(corners, {}));
  CHECK_THROWS(InvalidInput, make(corners, {0, 1, 3}));
  CHECK_THROWS(InvalidInput, make(corners, {0, 1, -1}));
  CHECK_THROWS(InvalidInput, make({0, 0, 0, 1, 0, 0, 0, NAN, 0}, {0, 1, 2}));
  CHECK_THROWS(InvalidInput, make({0, 0, 0, 1, 0, 0, 0, 1.1e11, 0}, {0, 1, 2}));
}
