// The Embree engine and scene against the DDA and the octree, with the library that RAYVOX_EMBREE names (bootstrap.py
// gives the one that embreex ships), so that the sanitizers see this code too.
#include <cstdio>
#include <cstdlib>

#include "brute_force.hpp"
#include "check.hpp"
#include "rayvox/error.hpp"
#include "rayvox/occupancy_map.hpp"
#include "rayvox/octree/node_stream.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/cast_ray.hpp"

using namespace rayvox;

namespace {

bool embree_is_there() {
  const char* path = std::getenv("RAYVOX_EMBREE");
  try {
    EmbreeLibrary::load(path ? std::vector<std::string>{path} : std::vector<std::string>{});
    return true;
  } catch (const EngineUnavailable& missing) {
    std::printf("skipped: RAYVOX_EMBREE names no Embree library: %s\n", missing.what());
    return false;
  }
}

// A scan from within a box whose sides lie `reach` cells away, and beyond which some rays go.
ScanRays scan_of_room(std::mt19937_64& random, int count, double reach, const Vec3d& centre) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  const Vec3d origin = centre + Vec3d{unit(random), unit(random), unit(random)} * (0.3 * reach);
  std::vector<Ray> rays;
  std::vector<bool> marks_end;
  for (int i = 0; i < count; ++i) {
    const Vec3d direction{normal(random), normal(random), normal(random)};
    const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
    rays.push_back({origin, origin + direction * (reach * (0.98 + 0.04 * unit(random)) / largest)});
    marks_end.push_back(unit(random) < 0.9);
  }
  return brute_force::scan_of(rays, marks_end);
}

}  // namespace

FACT(the_embree_engine_makes_the_map_of_single_cells) {
  if (!embree_is_there()) return;
  for (const int depth : {4, 5, 8, 16, 21}) {
    std::mt19937_64 random(static_cast<unsigned>(60 + depth));
    OccupancyMap map(MapGeometry(1.0, depth), SensorModel());
    brute_force::CellMap expected{SensorModel()};
    for (int scan = 0; scan < 8; ++scan) {
      const brute_force::RandomScan drawn(random, 80, 7);
      const OccupancyMap::Insertion done =
          map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end), Engine::embree);
      expected.insert(drawn.rays, drawn.marks_end);
      CHECK(brute_force::cells_of(map.snapshot()) == expected.cells);
      CHECK(done.statistics.engine == Engine::embree);
    }
  }
}

FACT(the_embree_engine_equals_the_dda_until_saturated_after_clearing_and_far_away) {
  if (!embree_is_there()) return;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    std::mt19937_64 random(77);
    OccupancyMap by_dda(MapGeometry(1.0, 18), SensorModel()), by_embree(MapGeometry(1.0, 18), SensorModel());
    const auto insert = [&](double reach, const Vec3d& centre) {
      const ScanRays scan = scan_of_room(random, 4000, reach, centre);
      by_dda.insert(scan, Engine::dda);
      return by_embree.insert(scan, Engine::embree).statistics;
    };
    for (int pass = 0; pass < 14; ++pass) insert(24, {0, 0, 0});
    CHECK(insert(24, {0, 0, 0}).bvh_node_count > 0);
    CHECK(write_nodes(by_embree.snapshot()) == write_nodes(by_dda.snapshot()));
    by_dda.clear_box({-9, -9, -9}, {5, 5, 5});
    by_embree.clear_box({-9, -9, -9}, {5, 5, 5});
    insert(24, {3, 0, 0});
    // Beyond the scene's reach, so that it is laid out anew, and back.
    insert(40, {90000, -90000, 500});
    insert(24, {0, 0, 0});
    CHECK(write_nodes(by_embree.snapshot()) == write_nodes(by_dda.snapshot()));
  }
  set_thread_count(2);
}

FACT(rays_through_the_scene_of_occupied_leaves_give_the_octrees_answers) {
  if (!embree_is_there()) return;
  std::mt19937_64 random(5);
  OccupancyMap map(MapGeometry(0.5, 16), SensorModel());
  for (int scan = 0; scan < 6; ++scan) map.insert(scan_of_room(random, 3000, 30, {10, 20, -5}), Engine::dda);
  const MapSnapshot snapshot = map.snapshot();
  RayScenes scenes;
  constexpr std::size_t count = 4000;
  std::vector<double> origins, directions;
  for (std::size_t i = 0; i < count; ++i) {
    const Ray ray = brute_force::awkward_ray(random, 20);
    const bool still = ray.end.x == ray.origin.x && ray.end.y == ray.origin.y && ray.end.z == ray.origin.z;
    for (int axis = 0; axis < 3; ++axis) {
      origins.push_back(ray.origin[axis] * 0.5);
      directions.push_back(still ? 1.0 : ray.end[axis] - ray.origin[axis]);
    }
  }
  const RayBatch batch{{nullptr, origins.data(), count}, {nullptr, directions.data(), count}, 0, false};
  std::vector<std::uint8_t> kind[2];
  std::vector<double> t_m[2];
  std::vector<std::int64_t> voxel[2];
  for (int i = 0; i < 2; ++i) {
    kind[i].resize(count), t_m[i].resize(count), voxel[i].resize(3 * count);
    cast_rays(snapshot, scenes, batch, i ? RayEngine::embree : RayEngine::octree,
              {kind[i].data(), t_m[i].data(), voxel[i].data()});
  }
  CHECK(kind[0] == kind[1] && t_m[0] == t_m[1] && voxel[0] == voxel[1]);
  CHECK(std::count(kind[0].begin(), kind[0].end(), 1) > 1000);
}
