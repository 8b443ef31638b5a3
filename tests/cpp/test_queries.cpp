#include "rayvox/octree/queries.hpp"

#include "brute_force.hpp"
#include "check.hpp"
#include "rayvox/error.hpp"
#include "rayvox/occupancy_map.hpp"
#include "rayvox/ray_shooting/cast_ray.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"

using namespace rayvox;

namespace {

struct Fixture {
  OccupancyMap map;
  std::map<Cell, float> cells;
  std::mt19937_64 random{15};

  explicit Fixture(int depth = 10) : map(MapGeometry(1.0, depth), SensorModel()) {
    for (int scan = 0; scan < 6; ++scan) {
      const brute_force::RandomScan drawn(random, 150, 18);
      for (int pass = 0; pass < 5; ++pass) map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
    }
    cells = brute_force::cells_of(map.snapshot());
  }
  int state(const Cell& cell) const {
    const auto entry = cells.find(cell);
    return entry == cells.end() ? 0 : entry->second >= 0 ? 2 : 1;
  }
};

}  // namespace

FACT(points_answer_with_their_cells_log_odds) {
  Fixture f;
  for (int x = -20; x < 20; ++x) {
    for (int y = -20; y < 20; ++y) {
      const double point[] = {x + 0.0, y + 0.999, -0.5};
      float log_odds;
      std::uint8_t state;
      log_odds_at(f.map.snapshot(), {nullptr, point, 1}, 0, &log_odds);
      states_at(f.map.snapshot(), {nullptr, point, 1}, 0, &state);
      const auto entry = f.cells.find({x, y, -1});
      CHECK(entry == f.cells.end() ? std::isnan(log_odds) : log_odds == entry->second);
      CHECK_EQUAL(int{state}, f.state({x, y, -1}));
    }
  }
}

FACT(coarser_levels_answer_with_the_maximum_below) {
  Fixture f;
  const MapSnapshot map = f.map.snapshot();
  for (int level = 1; level <= 6; ++level) {
    for (int sample = 0; sample < 200; ++sample) {
      Cell cell;
      for (auto& c : cell) c = std::uniform_int_distribution<int>(-24, 23)(f.random);
      float expected = -INFINITY;
      for (const auto& [at, value] : f.cells) {
        bool inside = true;
        for (std::size_t i = 0; i < 3; ++i) inside &= at[i] >> level == cell[i] >> level;
        if (inside) expected = std::max(expected, value);
      }
      const double point[] = {cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5};
      float log_odds;
      log_odds_at(map, {nullptr, point, 1}, level, &log_odds);
      CHECK(std::isinf(expected) ? std::isnan(log_odds) : log_odds == expected);
    }
  }
}

FACT(boxes_answer_as_their_cells_do_together) {
  Fixture f;
  for (int sample = 0; sample < 3000; ++sample) {
    double low[3], high[3];
    for (int i = 0; i < 3; ++i) {
      low[i] = brute_force::awkward_coordinate(f.random, 16);
      high[i] = low[i] + std::uniform_int_distribution<int>(0, 12)(f.random) / 4.0;
    }
    bool any_occupied = false, any_unknown = false;
    for (int x = static_cast<int>(std::floor(low[0])); x <= static_cast<int>(std::floor(high[0])); ++x) {
      for (int y = static_cast<int>(std::floor(low[1])); y <= static_cast<int>(std::floor(high[1])); ++y) {
        for (int z = static_cast<int>(std::floor(low[2])); z <= static_cast<int>(std::floor(high[2])); ++z) {
          any_occupied |= f.state({x, y, z}) == 2;
          any_unknown |= f.state({x, y, z}) == 0;
        }
      }
    }
    std::uint8_t state;
    states_of_boxes(f.map.snapshot(), {nullptr, low, 1}, {nullptr, high, 1}, &state);
    CHECK_EQUAL(int{state}, any_occupied ? 2 : any_unknown ? 0 : 1);
  }
}

namespace {

// Casts awkward rays, some of which end at borders, and walks the same rays cell by cell.
void check_that_rays_stop_at_the_first_cell_that_stops_them(RayEngine engine, int depth) {
  Fixture f(depth);
  const MapSnapshot map = f.map.snapshot();
  RayScenes scenes;
  int seen[3] = {};
  for (int sample = 0; sample < 4000; ++sample) {
    const Ray drawn = brute_force::awkward_ray(f.random, 20);
    const Vec3d direction = drawn.end - drawn.origin;
    if (norm(direction) == 0) continue;
    const double range = norm(direction);
    const bool unknown_stops = sample % 2;
    std::uint8_t kind;
    double t_m;
    std::int64_t voxel[3];
    const double origin[] = {drawn.origin.x, drawn.origin.y, drawn.origin.z};
    const double towards[] = {direction.x * 4, direction.y * 4, direction.z * 4};
    const RayBatch batch{{nullptr, origin, 1}, {nullptr, towards, 1}, range, unknown_stops};
    cast_rays(map, scenes, batch, engine, {&kind, &t_m, voxel});

    // The same ray as the kernel sees it, cell by cell.
    const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
    const Vec3d scaled{direction.x / largest, direction.y / largest, direction.z / largest};
    const Vec3d unit = scaled * (1.0 / norm(scaled));
    RayWalker walker({drawn.origin, drawn.origin + unit * range});
    int expected = 0;
    for (;; walker.leave_block(0)) {
      const int state = f.state(walker.cell());
      if (state == 2 || (state == 0 && unknown_stops)) {
        expected = state == 2 ? 1 : 2;
        break;
      }
      if (walker.end_in_block(0)) break;
    }
    ++seen[expected];
    CHECK_EQUAL(int{kind}, expected);
    if (expected) CHECK((Cell{int(voxel[0]), int(voxel[1]), int(voxel[2])} == walker.cell()));
    if (expected) CHECK(std::abs(t_m - walker.t() * range) < 1e-9);
  }
  CHECK(seen[0] > 100 && seen[1] > 100 && seen[2] > 100);
}

}  // namespace

FACT(rays_through_the_octree_stop_at_the_first_cell_that_stops_them) {
  for (const int depth : {7, 10}) check_that_rays_stop_at_the_first_cell_that_stops_them(RayEngine::octree, depth);
}

FACT(rays_through_masks_stop_at_the_first_cell_that_stops_them) {
  for (const int depth : {6, 7, 8, 10, 21}) {
    check_that_rays_stop_at_the_first_cell_that_stops_them(RayEngine::masks, depth);
  }
}

FACT(masks_of_a_uniform_octree_stop_rays_everywhere_or_nowhere) {
  for (const int depth : {4, 5}) {
    const MapGeometry geometry(1.0, depth);
    const double origin[] = {0.5, -0.25, 0.75}, direction[] = {1, 2, -3};
    for (const Child& root : {Child(), Child::leaf(-2), Child::leaf(2)}) {
      const MapSnapshot map{geometry, SensorModel(), root};
      for (const bool unknown_stops : {false, true}) {
        RayScenes scenes;
        std::uint8_t kind[2];
        double t_m[2];
        std::int64_t voxel[2][3];
        const RayBatch batch{{nullptr, origin, 1}, {nullptr, direction, 1}, 0, unknown_stops};
        cast_rays(map, scenes, batch, RayEngine::octree, {kind, t_m, voxel[0]});
        cast_rays(map, scenes, batch, RayEngine::masks, {kind + 1, t_m + 1, voxel[1]});
        CHECK_EQUAL(int{kind[1]}, int{kind[0]});
        CHECK(t_m[0] == t_m[1] && std::equal(voxel[0], voxel[0] + 3, voxel[1]));
      }
    }
  }
}

FACT(a_ray_that_leaves_the_octree_enters_the_unknown) {
  const OccupancyMap map(MapGeometry(1.0, 10), SensorModel());
  const double origin[] = {0.5, 0.5, 0.5}, direction[] = {1, 0, 0}, nowhere[] = {0, 0, 0}, outside[] = {1e9, 0, 0};
  std::uint8_t kind;
  double t_m;
  std::int64_t voxel[3];
  const RayHits out{&kind, &t_m, voxel};
  for (const RayEngine engine : {RayEngine::automatic, RayEngine::masks}) {
    RayScenes scenes;
    const auto cast = [&](const double* from, const double* towards, bool unknown_stops) {
      const RayBatch batch{{nullptr, from, 1}, {nullptr, towards, 1}, 0, unknown_stops};
      cast_rays(map.snapshot(), scenes, batch, engine, out);
    };
    cast(origin, direction, false);
    CHECK_EQUAL(int{kind}, 0);
    CHECK_EQUAL(t_m, 511.5);
    cast(origin, direction, true);
    CHECK_EQUAL(int{kind}, 2);
    CHECK_EQUAL(t_m, 0.0);
    CHECK_THROWS(InvalidInput, cast(origin, nowhere, true));
    CHECK_THROWS(OutOfRange, cast(outside, direction, true));
  }
}
