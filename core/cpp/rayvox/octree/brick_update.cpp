#include "rayvox/octree/brick_update.hpp"

#include <algorithm>

#include "rayvox/octree/brick.hpp"

namespace rayvox {
namespace {

constexpr std::uint64_t all_cells = ~std::uint64_t{0};

struct UpdatedOctant {
  alignas(64) float log_odds[cells_per_octant];
  OctantOutput result;
  std::uint64_t known;

  bool uniform() const { return known == all_cells && result.min == result.max; }
};

// What the slot holds in one octant before the update.
struct OctantView {
  const float* cells = nullptr;  // null: no cell is stored
  std::uint64_t known = 0;
  float max_log_odds = 0, min_log_odds = 0;  // over known cells

  OctantView(const Child& slot, int octant) {
    if (slot.is_leaf()) {
      known = all_cells;
      max_log_odds = min_log_odds = slot.leaf_log_odds();
    } else if (!slot.is_unknown()) {
      const Brick& brick = *slot.brick();
      known = brick.known[octant];
      if (brick.is_dense(octant)) cells = brick.cells(octant);
      if (known) max_log_odds = brick.octant_max[octant];
      if (known) min_log_odds = brick.octant_min[octant];
    }
  }
  // Cells that a miss may change: in steady state most are at the bound, and octants wholly at it are not even read.
  std::uint64_t changed_by_miss(const UpdateModel& model, const Kernels& kernels) const {
    if (!known || max_log_odds <= model.clamp_min) return ~known;
    return cells ? ~known | kernels.cells_above(cells, model.clamp_min) : all_cells;
  }
  // Cells that a hit may change.
  std::uint64_t changed_by_hit(const UpdateModel& model) const {
    return known && min_log_odds >= model.clamp_max ? ~known : all_cells;
  }
};

bool update_octant(const OctantView& before, std::uint64_t free, std::uint64_t occupied, const UpdateModel& model,
                   const Kernels& kernels, UpdatedOctant& after) {
  alignas(64) float filled[cells_per_octant];
  const float* cells = before.cells;
  if (!cells) {
    std::fill_n(filled, cells_per_octant, before.known ? before.max_log_odds : 0.0f);
    cells = filled;
  }
  after.known = before.known | free | occupied;
  after.result = kernels.update_octant({cells, before.known, free, occupied}, model, after.log_odds);
  return after.result.changed != 0;
}

// A brick of its own with the slot's other octants, and room for the updated ones.
Child clone_without(std::uint8_t updated_mask, const Child& slot, std::uint8_t dense_mask) {
  Brick* brick = Brick::create(dense_mask);
  for (int i = 0; i < 8; ++i) {
    if (updated_mask >> i & 1) continue;
    const OctantView before(slot, i);
    brick->known[i] = before.known;
    if (!before.known) continue;
    brick->octant_max[i] = before.max_log_odds;
    brick->octant_min[i] = before.min_log_odds;
    if (before.cells) std::copy_n(before.cells, cells_per_octant, brick->cells(i));
  }
  return Child::adopt(brick);
}

bool all_uniform_and_equal(const Brick& brick) {
  if (brick.dense_mask) return false;
  for (int i = 0; i < 8; ++i) {
    if (brick.known[i] != all_cells || brick.octant_max[i] != brick.octant_max[0]) return false;
  }
  return true;
}

// update_brick of an unknown slot: nothing to read, and only two values to write.
int fill_brick(Child& slot, const BrickMarks& marks, const UpdateModel& model, const Kernels& kernels) {
  const float freed = std::clamp(model.miss, model.clamp_min, model.clamp_max);
  const float hit = std::clamp(model.hit, model.clamp_min, model.clamp_max);
  int changed = 0;
  std::uint8_t dense_mask = 0;
  for (int i = 0; i < 8; ++i) {
    const std::uint64_t free = marks.free[i], occupied = marks.occupied[i], known = free | occupied;
    if (!known) continue;
    changed += __builtin_popcountll(known);
    const bool uniform = free == all_cells || occupied == all_cells || (known == all_cells && freed == hit);
    if (!uniform) dense_mask |= static_cast<std::uint8_t>(1u << i);
  }
  if (!changed) return 0;
  Brick& brick = *Brick::create(dense_mask);
  slot = Child::adopt(&brick);
  for (int i = 0; i < 8; ++i) {
    const std::uint64_t free = marks.free[i], occupied = marks.occupied[i];
    brick.known[i] = free | occupied;
    if (!brick.known[i]) continue;
    brick.octant_max[i] = !free ? hit : !occupied ? freed : std::max(freed, hit);
    brick.octant_min[i] = !free ? hit : !occupied ? freed : std::min(freed, hit);
    if (brick.is_dense(i)) kernels.fill_octant(free, freed, occupied, hit, brick.cells(i));
  }
  if (all_uniform_and_equal(brick)) slot = Child::leaf(brick.octant_max[0]);
  return changed;
}

}  // namespace

int update_brick(Child& slot, const BrickMarks& marks, const UpdateModel& model, const Kernels& kernels) {
  if (slot.is_unknown()) return fill_brick(slot, marks, model, kernels);
  UpdatedOctant updated[8];
  std::uint8_t updated_mask = 0;
  std::uint8_t dense_mask = slot.kind() == Child::Kind::brick ? slot.brick()->dense_mask : 0;
  int changed = 0;
  for (int i = 0; i < 8; ++i) {
    const OctantView before(slot, i);
    std::uint64_t free = marks.free[i], occupied = marks.occupied[i];
    if (free) free &= before.changed_by_miss(model, kernels);
    if (occupied) occupied &= before.changed_by_hit(model);
    if (!(free | occupied)) continue;
    if (!update_octant(before, free, occupied, model, kernels, updated[i])) continue;
    const auto bit = static_cast<std::uint8_t>(1u << i);
    updated_mask |= bit;
    dense_mask = static_cast<std::uint8_t>(updated[i].uniform() ? dense_mask & ~bit : dense_mask | bit);
    changed += __builtin_popcountll(updated[i].result.changed);
  }
  if (!changed) return 0;

  const bool in_place = slot.kind() == Child::Kind::brick && slot.brick()->dense_mask == dense_mask &&
                        slot.brick()->references.load(std::memory_order_acquire) == 1;
  if (!in_place) slot = clone_without(updated_mask, slot, dense_mask);
  Brick& brick = *slot.brick();
  for (int i = 0; i < 8; ++i) {
    if (!(updated_mask >> i & 1)) continue;
    brick.known[i] = updated[i].known;
    brick.octant_max[i] = updated[i].result.max;
    brick.octant_min[i] = updated[i].result.min;
    if (brick.is_dense(i)) std::copy_n(updated[i].log_odds, cells_per_octant, brick.cells(i));
  }
  if (all_uniform_and_equal(brick)) slot = Child::leaf(brick.octant_max[0]);
  return changed;
}

}  // namespace rayvox
