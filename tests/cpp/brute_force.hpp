#pragma once
// Oracles that share no code with what they judge.
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "rayvox/octree/leaves.hpp"
#include "rayvox/octree/sensor_model.hpp"
#include "rayvox/ray_shooting/ray.hpp"
#include "rayvox/ray_shooting/scan_rays.hpp"

namespace brute_force {

using rayvox::Cell;
using Integer = __int128;

/// Coordinates are drawn as multiples of 1 / grid, so that integers hold them exactly.
constexpr std::int64_t grid = 1 << 12;

inline Integer exact(double coordinate) { return static_cast<Integer>(std::llround(coordinate * grid)); }

/// Whether the ray has a point in the half-open cell: the parameter intervals of the three axes and [0, 1] intersect.
inline bool passes(const rayvox::Ray& ray, const Cell& cell) {
  // Bounds are fractions n / d with d > 0; `open` excludes the bound itself.
  struct Bound {
    Integer n, d;
    bool open;
  };
  Bound low{0, 1, false}, high{1, 1, false};
  const auto raise = [&](Bound b) {
    const Integer order = b.n * low.d - low.n * b.d;
    if (order > 0 || (order == 0 && b.open)) low = b;
  };
  const auto lower = [&](Bound b) {
    const Integer order = b.n * high.d - high.n * b.d;
    if (order < 0 || (order == 0 && b.open)) high = b;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const Integer o = exact(ray.origin[axis]), d = exact(ray.end[axis]) - o;
    const Integer from = Integer{cell[axis]} * grid - o, to = from + grid;
    if (d == 0) {
      if (from > 0 || to <= 0) return false;
    } else if (d > 0) {
      raise({from, d, false});
      lower({to, d, true});
    } else {
      raise({-to, -d, true});
      lower({-from, -d, false});
    }
  }
  const Integer order = low.n * high.d - high.n * low.d;
  return order < 0 || (order == 0 && !low.open && !high.open);
}

inline std::set<Cell> passed_cells(const rayvox::Ray& ray) {
  std::set<Cell> cells;
  Cell low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = static_cast<int>(std::floor(std::min(ray.origin[axis], ray.end[axis])));
    high[axis] = static_cast<int>(std::floor(std::max(ray.origin[axis], ray.end[axis])));
  }
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        if (passes(ray, {x, y, z})) cells.insert({x, y, z});
      }
    }
  }
  return cells;
}

/// A coordinate that often lies on a cell border, sometimes a hair beside it.
inline double awkward_coordinate(std::mt19937_64& random, int reach) {
  const auto whole = static_cast<double>(std::uniform_int_distribution<int>(-reach, reach)(random));
  switch (std::uniform_int_distribution<int>(0, 5)(random)) {
    case 0: return whole;
    case 1: return whole + 0.5;
    case 2: return whole + 1.0 / grid;
    case 3: return whole - 1.0 / grid;
    default: return whole + static_cast<double>(std::uniform_int_distribution<int>(0, grid - 1)(random)) / grid;
  }
}

inline rayvox::Ray awkward_ray(std::mt19937_64& random, int reach) {
  rayvox::Ray ray;
  for (int axis = 0; axis < 3; ++axis) {
    ray.origin[axis] = awkward_coordinate(random, reach);
    ray.end[axis] =
        std::uniform_int_distribution<int>(0, 3)(random) ? awkward_coordinate(random, reach) : ray.origin[axis];
  }
  return ray;
}

/// A map without an octree: log-odds per cell, OctoMap's update.
class CellMap {
 public:
  explicit CellMap(const rayvox::SensorModel& model) : model_(model) {}

  void insert(const std::vector<rayvox::Ray>& rays, const std::vector<bool>& marks_end) {
    std::set<Cell> free, occupied;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      std::set<Cell> passed = passed_cells(rays[i]);
      const Cell end{static_cast<int>(std::floor(rays[i].end.x)), static_cast<int>(std::floor(rays[i].end.y)),
                     static_cast<int>(std::floor(rays[i].end.z))};
      passed.erase(end);
      free.insert(passed.begin(), passed.end());
      if (marks_end[i]) occupied.insert(end);
    }
    for (const Cell& cell : free) {
      if (!occupied.count(cell)) update(cell, model_.miss_log_odds);
    }
    for (const Cell& cell : occupied) update(cell, model_.hit_log_odds);
  }
  void clear(const Cell& low, const Cell& high) {
    std::erase_if(cells, [&](const auto& entry) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (entry.first[i] < low[i] || entry.first[i] > high[i]) return false;
      }
      return true;
    });
  }

  std::map<Cell, float> cells;

 private:
  void update(const Cell& cell, float log_odds) {
    const auto [entry, added] = cells.try_emplace(cell, 0.0f);
    float& value = entry->second;
    const bool at_bound = log_odds >= 0 ? value >= model_.clamp_max_log_odds : value <= model_.clamp_min_log_odds;
    if (!added && at_bound) return;
    value = std::min(std::max(value + log_odds, model_.clamp_min_log_odds), model_.clamp_max_log_odds);
  }
  rayvox::SensorModel model_;
};

/// A snapshot's leaves, taken apart into cells.
inline std::map<Cell, float> cells_of(const rayvox::MapSnapshot& map) {
  const rayvox::LeafReadout readout(map);
  std::vector<std::int64_t> keys(3 * readout.count());
  std::vector<std::uint8_t> depth(readout.count());
  std::vector<float> log_odds(readout.count());
  readout.write({keys.data(), depth.data(), log_odds.data()});
  std::map<Cell, float> cells;
  for (std::size_t i = 0; i < readout.count(); ++i) {
    const int size = 1 << (map.geometry.depth() - depth[i]);
    for (int x = 0; x < size; ++x) {
      for (int y = 0; y < size; ++y) {
        for (int z = 0; z < size; ++z) {
          cells[{static_cast<int>(keys[3 * i]) + x, static_cast<int>(keys[3 * i + 1]) + y,
                 static_cast<int>(keys[3 * i + 2]) + z}] = log_odds[i];
        }
      }
    }
  }
  return cells;
}

inline rayvox::ScanRays scan_of(const std::vector<rayvox::Ray>& rays, const std::vector<bool>& marks_end) {
  rayvox::ScanRays scan;
  scan.origin = rays.front().origin;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) scan.end[axis].push_back(rays[i].end[axis]);
    scan.marks_end.push_back(marks_end[i]);
  }
  return scan;
}

/// A scan of `count` awkward rays from one awkward origin.
struct RandomScan {
  std::vector<rayvox::Ray> rays;
  std::vector<bool> marks_end;

  RandomScan(std::mt19937_64& random, int count, int reach) {
    const rayvox::Vec3d origin = awkward_ray(random, reach).origin;
    for (int i = 0; i < count; ++i) {
      rayvox::Ray ray = awkward_ray(random, reach);
      ray.origin = origin;
      rays.push_back(ray);
      marks_end.push_back(std::uniform_int_distribution<int>(0, 4)(random) != 0);
    }
  }
};

}  // namespace brute_force
