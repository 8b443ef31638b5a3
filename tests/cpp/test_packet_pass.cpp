// Packets through octree nodes, on every instruction set, against the exact walker.
#include <cstdlib>

#include "brute_force.hpp"
#include "check.hpp"
#include "rayvox/octree/map_geometry.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"
#include "rayvox/simd/kernels.hpp"

using namespace rayvox;

namespace {

/// A node that the ray may well pass: around or beside one of its points.
Cell node_near(const Ray& ray, int level, std::mt19937_64& random) {
  const double t = std::uniform_real_distribution<double>(0, 1)(random);
  Cell cell = MapGeometry::cell_of(ray.origin + (ray.end - ray.origin) * t);
  for (std::int32_t& place : cell) {
    place = place >> level << level;
    if (std::uniform_int_distribution<int>(0, 5)(random) == 0) place += 1 << level;
  }
  return cell;
}

int cells_apart(const Cell& a, const Cell& b) {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

bool in_block(const Cell& cell, const Cell& first, int level) {
  return ((cell[0] ^ first[0]) >> level | (cell[1] ^ first[1]) >> level | (cell[2] ^ first[2]) >> level) == 0;
}

struct Sample {
  Ray rays[RayPacket::width];
  RayPacket packet;
  PacketBox box;
  Cell first;
  int level;

  explicit Sample(std::mt19937_64& random) {
    const Ray drawn = brute_force::awkward_ray(random, 30);
    const Vec3d origin = drawn.origin;
    const Cell start = MapGeometry::cell_of(origin);
    level = std::uniform_int_distribution<int>(0, 4)(random);
    first = node_near(drawn, level, random);
    box.size = static_cast<float>(1 << level);
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      box.first[axis] = static_cast<float>(first[i] - start[i]);
      box.low[axis] = static_cast<float>(first[i] - origin[axis]);
      box.high[axis] = static_cast<float>(first[i] + (1 << level) - origin[axis]);
    }
    for (int lane = 0; lane < RayPacket::width; ++lane) {
      Ray& ray = rays[lane];
      if (lane > 0) ray = brute_force::awkward_ray(random, 30);
      if (lane < 8) ray.end = drawn.end + (ray.end - origin) * 0.0625;
      ray.origin = origin;
      for (int axis = 0; axis < 3; ++axis) {
        const double d = ray.end[axis] - origin[axis];
        packet.direction[axis][lane] = static_cast<float>(d);
        packet.inverse[axis][lane] = d == 0 ? 0 : static_cast<float>(1 / d);
        packet.end_cell[axis][lane] =
            static_cast<float>(floor_to_cell(ray.end[axis]) - start[static_cast<std::size_t>(axis)]);
      }
    }
  }
};

}  // namespace

FACT(what_a_packet_is_sure_of_equals_the_exact_walk) {
  for (const char* name : {"portable", "avx2", "avx512"}) {
    const Kernels* set = kernels_for(name);
    if (!set) continue;
    std::mt19937_64 random(17);
    std::size_t passed_count = 0, missed_count = 0, doubtful_count = 0;
    for (int round = 0; round < 4000; ++round) {
      const Sample sample(random);
      PassedBox passed;
      set->pass_box(sample.packet, sample.box, 0xffff, passed);
      CHECK((passed.lanes & passed.doubtful) == 0);
      for (int lane = 0; lane < RayPacket::width; ++lane) {
        if (passed.doubtful >> lane & 1) {
          ++doubtful_count;
          continue;
        }
        RayWalker walker(sample.rays[lane]);
        const bool enters = walker.enter_block(sample.first, sample.level);
        CHECK_EQUAL(bool(passed.lanes >> lane & 1), enters);
        ++(enters ? passed_count : missed_count);
        if (!enters || !(passed.lanes >> lane & 1)) continue;
        const Cell entry = walker.cell();
        for (std::size_t axis = 0; axis < 3; ++axis) {
          CHECK_EQUAL(static_cast<int>(passed.entry[axis][lane]), entry[axis] - sample.first[axis]);
        }
        const bool stays = walker.end_in_block(sample.level);
        if (!stays) walker.leave_block(sample.level);
        const int crossings = cells_apart(entry, stays ? walker.end_cell() : walker.cell());
        CHECK_EQUAL(static_cast<int>(passed.crossings[lane]), crossings);
      }
    }
    std::printf("%s: %zu passed, %zu missed, %zu doubtful\n", name, passed_count, missed_count, doubtful_count);
    CHECK(passed_count > 2000 && missed_count > 10000 && doubtful_count > 100);
  }
}

FACT(a_block_is_entered_where_a_walk_cell_by_cell_first_meets_it) {
  std::mt19937_64 random(23);
  int entered = 0;
  for (int round = 0; round < 20000; ++round) {
    const Ray ray = brute_force::awkward_ray(random, 20);
    const int level = std::uniform_int_distribution<int>(0, 4)(random);
    const Cell first = node_near(ray, level, random);
    RayWalker direct(ray), stepping(ray);
    while (!in_block(stepping.cell(), first, level) && !stepping.end_in_block(0)) stepping.leave_block(0);
    const bool met = in_block(stepping.cell(), first, level);
    CHECK_EQUAL(direct.enter_block(first, level), met);
    if (!met) continue;
    ++entered;
    CHECK((direct.cell() == stepping.cell()));
    CHECK(std::abs(direct.t() - stepping.t()) < 1e-12);
  }
  CHECK(entered > 1000);
}
