#include "rayvox/simd/kernels.hpp"

#include <cstring>
#include <memory>

#include "brute_force.hpp"
#include "check.hpp"
#include "rayvox/octree/morton.hpp"
#include "rayvox/ray_shooting/tile_bins.hpp"

using namespace rayvox;

namespace {

const Kernels* const all_sets[] = {kernels_for("portable"), kernels_for("avx2"), kernels_for("avx512")};

}  // namespace

FACT(every_instruction_set_marks_exactly_the_cells_the_rays_free) {
  const MapGeometry geometry(1.0, 16);
  const auto marks = std::make_unique<TileMarks>();
  std::mt19937_64 random(4);
  for (int sample = 0; sample < 60; ++sample) {
    const brute_force::RandomScan scan(random, 1 + sample % 40, 9);
    const ScanRays rays = brute_force::scan_of(scan.rays, scan.marks_end);
    std::set<Cell> expected;
    for (const Ray& ray : scan.rays) {
      std::set<Cell> passed = brute_force::passed_cells(ray);
      passed.erase(MapGeometry::cell_of(ray.end));
      expected.insert(passed.begin(), passed.end());
    }
    std::vector<TileBins> workers(1);
    workers[0].add_rays(rays, 0, rays.count(), geometry);
    for (const Kernels* set : all_sets) {
      if (!set) continue;
      std::set<Cell> marked;
      for (const TileBin& bin : workers[0].bins()) {
        std::memset(marks.get(), 0, sizeof(TileMarks));
        const Cell low = geometry.cell_of_morton(bin.tile << 18);
        set->walk_segments({{rays.origin.x, rays.origin.y, rays.origin.z},
                            {rays.end[0].data(), rays.end[1].data(), rays.end[2].data()},
                            {low[0], low[1], low[2]},
                            bin.segments.data(),
                            bin.segments.size()},
                           *marks);
        for (std::size_t cell = 0; cell < tile_cells; ++cell) {
          if (marks->cell[cell]) {
            marked.insert({low[0] + static_cast<int>(morton_x(cell)), low[1] + static_cast<int>(morton_y(cell)),
                           low[2] + static_cast<int>(morton_z(cell))});
          }
        }
      }
      CHECK(marked == expected);
    }
  }
}

FACT(every_instruction_set_updates_an_octant_as_octomap_does) {
  const SensorModel m;
  const UpdateModel model{m.hit_log_odds, m.miss_log_odds, m.clamp_min_log_odds, m.clamp_max_log_odds};
  std::mt19937_64 random(5);
  for (int sample = 0; sample < 2000; ++sample) {
    alignas(64) float before[64] = {}, expected[64];
    const std::uint64_t known = random() | (sample % 2 ? random() : 0);
    const std::uint64_t occupied = random() & random() & random(), free = random() & ~occupied;
    std::uint64_t changed = 0;
    float low = INFINITY, high = -INFINITY;
    for (int c = 0; c < 64; ++c) {
      const float values[] = {m.clamp_min_log_odds, m.clamp_max_log_odds, 0.0f, -0.3f, 1.7f, 5.0f};
      if (known >> c & 1) before[c] = values[random() % 6];
      expected[c] = before[c];
      const bool hit = occupied >> c & 1, miss = free >> c & 1, was_known = known >> c & 1;
      const bool at_bound = was_known && (hit ? before[c] >= model.clamp_max : before[c] <= model.clamp_min);
      if ((hit || miss) && !at_bound) {
        const float added = before[c] + (hit ? model.hit : model.miss);
        expected[c] = added < model.clamp_min ? model.clamp_min : added > model.clamp_max ? model.clamp_max : added;
        if (!was_known || expected[c] != before[c]) changed |= std::uint64_t{1} << c;
      }
      if (was_known || hit || miss) low = std::min(low, expected[c]), high = std::max(high, expected[c]);
    }
    for (const Kernels* set : all_sets) {
      if (!set) continue;
      alignas(64) float after[64];
      const OctantOutput out = set->update_octant({before, known, free, occupied}, model, after);
      CHECK(std::memcmp(after, expected, sizeof after) == 0);
      CHECK_EQUAL(out.changed, changed);
      CHECK_EQUAL(out.min, low);
      CHECK_EQUAL(out.max, high);
    }
  }
}

FACT(taking_marks_gives_their_masks_and_leaves_none) {
  std::mt19937_64 random(6);
  for (const Kernels* set : all_sets) {
    if (!set) continue;
    alignas(64) std::uint8_t marks[512] = {};
    std::uint64_t free[8], occupied[8];
    CHECK(!set->take_marks(marks, free, occupied));
    std::uint64_t expected_free[8] = {}, expected_occupied[8] = {};
    for (int c = 0; c < 512; ++c) {
      marks[c] = static_cast<std::uint8_t>(random() % 3);
      expected_free[c / 64] |= static_cast<std::uint64_t>(marks[c] == TileMarks::free) << (c % 64);
      expected_occupied[c / 64] |= static_cast<std::uint64_t>(marks[c] == TileMarks::occupied) << (c % 64);
    }
    CHECK(set->take_marks(marks, free, occupied));
    CHECK(std::memcmp(free, expected_free, sizeof free) == 0);
    CHECK(std::memcmp(occupied, expected_occupied, sizeof occupied) == 0);
    for (const std::uint8_t mark : marks) CHECK_EQUAL(int{mark}, 0);
    marks[511] = TileMarks::occupied;
    CHECK(set->take_marks(marks, free, occupied));
    CHECK_EQUAL(occupied[7], std::uint64_t{1} << 63);
  }
}

FACT(an_unknown_instruction_set_has_no_kernels) { CHECK(kernels_for("mmx") == nullptr); }
