#pragma once
// Small maps with voxels of all sizes, by seeded generators.
#include <cstdint>
#include <random>

#include "collision_meshes.hpp"
#include "rayvox/octree/box.hpp"
#include "rayvox/octree/edit.hpp"
#include "rayvox/octree/map_snapshot.hpp"

namespace random_maps {

using namespace rayvox;

inline constexpr float free_value = -1.0f, occupied_value = 1.5f;

// Occupied, free and unknown nodes of all sizes in a box of cells; beyond it nothing is known.
struct RandomMap {
  std::mt19937_64& random;
  CellBox box;
  double share_occupied;

  float value() { return collision_meshes::uniform(random, 0, 1) < share_occupied ? occupied_value : free_value; }
  Child slot(const Cell& first, int level) {
    if (!box.overlaps(first, level)) return {};
    const double what = collision_meshes::uniform(random, 0, 1);
    if (box.contains(first, level) && what < 0.12) return what < 0.04 ? Child() : Child::leaf(value());
    if (level == brick_level) return brick();
    Child slot = Child::adopt(new InnerNode);
    for (int i = 0; i < 8; ++i) slot.inner()->child[i] = this->slot(child_cell(first, level, i), level - 1);
    close_inner(slot);
    return slot;
  }
  Child brick() {
    OpenBrick open;
    for (int group = 0; group < 64; ++group) {
      const bool uniform_group = random() % 3 == 0;
      const float value_of_group = value();
      const unsigned known = random() % 8 == 0   ? 0u
                             : random() % 4 == 0 ? static_cast<unsigned>(random() & 0xff)
                                                 : 0xffu;
      open.known[group / 8] |= std::uint64_t{known} << (8 * (group % 8));
      for (int i = 0; i < 8; ++i) {
        if (known >> i & 1) open.log_odds[8 * group + i] = uniform_group ? value_of_group : value();
      }
    }
    return open.close();
  }
};

inline MapSnapshot random_map(std::mt19937_64& random, double resolution_m, int depth, const CellBox& box,
                              double share) {
  MapSnapshot map{MapGeometry(resolution_m, depth), SensorModel(), {}, 0, 0, 0};
  map.root = RandomMap{random, box, share}.slot(root_cell(map.geometry), depth);
  return map;
}

}  // namespace random_maps
