#include "brute_force.hpp"
#include "check.hpp"
#include "rayvox/occupancy_map.hpp"
#include "rayvox/octree/map_statistics.hpp"
#include "rayvox/octree/node_stream.hpp"
#include "rayvox/parallel/parallel_for.hpp"

using namespace rayvox;

FACT(a_map_of_random_scans_equals_a_map_of_single_cells) {
  for (const int depth : {5, 6, 8, 16, 21}) {
    std::mt19937_64 random(static_cast<unsigned>(depth));
    OccupancyMap map(MapGeometry(1.0, depth), SensorModel());
    brute_force::CellMap expected{SensorModel()};
    for (int scan = 0; scan < 12; ++scan) {
      const brute_force::RandomScan drawn(random, 60, 12);
      map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
      expected.insert(drawn.rays, drawn.marks_end);
      CHECK(brute_force::cells_of(map.snapshot()) == expected.cells);
    }
  }
}

FACT(every_engine_makes_the_map_of_single_cells) {
  for (const Engine engine : {Engine::dda, Engine::beam}) {
    for (const int depth : {5, 8, 16, 21}) {
      std::mt19937_64 random(static_cast<unsigned>(40 + depth));
      OccupancyMap map(MapGeometry(1.0, depth), SensorModel());
      brute_force::CellMap expected{SensorModel()};
      for (int scan = 0; scan < 8; ++scan) {
        const brute_force::RandomScan drawn(random, 80, 12);
        const OccupancyMap::Insertion done = map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end), engine);
        expected.insert(drawn.rays, drawn.marks_end);
        CHECK(brute_force::cells_of(map.snapshot()) == expected.cells);
        CHECK(engine == Engine::beam || done.statistics.engine == engine);
      }
    }
  }
}

namespace {

// Depth camera with dropouts: a wall some way off, seen from a turned sensor.
ScanRays camera_scan(std::mt19937_64& random, int columns, int rows, double depth) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double yaw = 6.3 * unit(random), c = std::cos(yaw), s = std::sin(yaw), tilt = unit(random) - 0.5;
  const Vec3d origin{8 * unit(random), 8 * unit(random), 8 * unit(random)};
  std::vector<Ray> rays;
  std::vector<bool> marks_end;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (unit(random) < 0.05) continue;
      const double u = (column + 0.5) / columns - 0.5, v = (row + 0.5) / rows - 0.5 + tilt;
      const double reach = depth * (0.5 + 0.5 * std::abs(std::sin(9 * u) * std::cos(7 * v)));
      rays.push_back({origin, origin + Vec3d{(c - s * u) * reach, (s + c * u) * reach, v * reach}});
      marks_end.push_back(unit(random) < 0.9);
    }
  }
  return brute_force::scan_of(rays, marks_end);
}

}  // namespace

FACT(the_beam_engine_equals_the_dda_from_the_first_scan_to_saturation) {
  for (const double depth : {9.0, 70.0, 250.0}) {
    std::mt19937_64 random(static_cast<unsigned>(depth));
    OccupancyMap by_dda(MapGeometry(1.0, 16), SensorModel()), by_beam(MapGeometry(1.0, 16), SensorModel());
    std::vector<ScanRays> scans;
    for (int scan = 0; scan < 3; ++scan) scans.push_back(camera_scan(random, 80, 60, depth));
    for (int pass = 0; pass < 7; ++pass) {
      for (const ScanRays& scan : scans) {
        const std::uint64_t changed = by_dda.insert(scan, Engine::dda).statistics.voxels_changed;
        const ScanStatistics statistics = by_beam.insert(scan, Engine::beam).statistics;
        CHECK(statistics.engine == Engine::beam);
        CHECK_EQUAL(statistics.voxels_changed, changed);
      }
      CHECK(write_nodes(by_beam.snapshot()) == write_nodes(by_dda.snapshot()));
    }
  }
}

FACT(saturated_space_is_pruned_to_large_leaves_and_split_again) {
  OccupancyMap map(MapGeometry(1.0, 16), SensorModel());
  brute_force::CellMap expected{SensorModel()};
  // Rays through every cell of a 16x16 front clear a block of whole bricks.
  std::vector<Ray> rays;
  for (int y = 0; y < 16; ++y) {
    for (int z = 0; z < 16; ++z) rays.push_back({{0.5, y + 0.5, z + 0.5}, {16.5, y + 0.5, z + 0.5}});
  }
  const auto insert = [&](const std::vector<Ray>& some, bool marks_end) {
    for (const Ray& ray : some) {
      map.insert(brute_force::scan_of({ray}, {marks_end}));
      expected.insert({ray}, {marks_end});
    }
  };
  for (int pass = 0; pass < 5; ++pass) insert(rays, false);
  const MapStatistics saturated = statistics_of(map.snapshot());
  CHECK_EQUAL(saturated.free_leaves, 1u);  // 16x16x16 cells, one leaf
  CHECK_EQUAL(saturated.free_cells, 4096u);
  insert({{{0.5, 3.5, 3.5}, {5.5, 3.5, 3.5}}}, true);
  CHECK(brute_force::cells_of(map.snapshot()) == expected.cells);
  CHECK_EQUAL(statistics_of(map.snapshot()).occupied_leaves, 0u);  // one hit does not outweigh five misses
  CHECK(statistics_of(map.snapshot()).free_leaves > 1u);
}

FACT(the_number_of_threads_does_not_change_the_map) {
  std::string first;
  for (const int threads : {1, 2, 3, 8}) {
    set_thread_count(threads);
    std::mt19937_64 random(7);
    OccupancyMap map(MapGeometry(0.1, 16), SensorModel());
    for (int scan = 0; scan < 4; ++scan) {
      const brute_force::RandomScan drawn(random, 5000, 150);
      map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
    }
    const std::string nodes = write_nodes(map.snapshot());
    if (first.empty()) first = nodes;
    CHECK(nodes == first);
  }
  set_thread_count(2);
}

FACT(the_number_of_threads_does_not_change_what_beams_make) {
  std::string first;
  for (const int threads : {1, 2, 3, 8}) {
    set_thread_count(threads);
    std::mt19937_64 random(17);
    OccupancyMap map(MapGeometry(0.1, 16), SensorModel());
    for (int scan = 0; scan < 3; ++scan) map.insert(camera_scan(random, 160, 120, 90.0), Engine::beam);
    const std::string nodes = write_nodes(map.snapshot());
    if (first.empty()) first = nodes;
    CHECK(nodes == first);
  }
  set_thread_count(2);
}

FACT(sensor_models_at_their_limits_make_the_map_of_single_cells) {
  for (const SensorModel& model : {SensorModel(0.5, 0.5, 0.12, 0.97, 0.5), SensorModel(0.7, 0.4, 0.45, 0.55, 0.5),
                                   SensorModel(0.7, 0.4, 0.6, 0.97, 0.5), SensorModel(0.9, 0.1, 0.2, 0.4, 0.5)}) {
    std::mt19937_64 random(23);
    OccupancyMap map(MapGeometry(1.0, 16), model);
    brute_force::CellMap expected{model};
    for (int scan = 0; scan < 6; ++scan) {
      const brute_force::RandomScan drawn(random, 200, 9);
      map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
      expected.insert(drawn.rays, drawn.marks_end);
      CHECK(brute_force::cells_of(map.snapshot()) == expected.cells);
    }
  }
}

FACT(a_scan_that_repeats_saturated_knowledge_changes_nothing) {
  std::mt19937_64 random(8);
  OccupancyMap map(MapGeometry(1.0, 16), SensorModel());
  const brute_force::RandomScan drawn(random, 50, 10);
  const ScanRays rays = brute_force::scan_of(drawn.rays, drawn.marks_end);
  for (int pass = 0; pass < 20; ++pass) map.insert(rays);
  const std::string before = write_nodes(map.snapshot());
  const OccupancyMap::Insertion last = map.insert(rays);
  CHECK_EQUAL(last.statistics.voxels_changed, 0u);
  CHECK_EQUAL(last.revision, 21u);
  CHECK(write_nodes(map.snapshot()) == before);
}

FACT(a_cut_ray_marks_no_end) {
  const MapGeometry geometry(0.5, 16);
  const double points[] = {10, 0.1, 0.1, 2, 0.1, 0.1};
  Scan scan{};
  scan.points_sensor = {nullptr, points, 2};
  scan.origin_sensor_m = {0.1, 0.1, 0.1};
  scan.max_range_m = 5;
  const ScanRays rays = prepare_scan(scan, geometry);
  CHECK_EQUAL(int{rays.marks_end[0]}, 0);
  CHECK_EQUAL(int{rays.marks_end[1]}, 1);
  CHECK(std::abs(rays.end[0][0] - 10.2) < 1e-12);
}
