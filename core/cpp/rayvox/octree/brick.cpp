#include "rayvox/octree/brick.hpp"

#include <algorithm>
#include <limits>
#include <new>

namespace rayvox {

std::size_t Brick::bytes(std::uint8_t dense_mask) {
  return sizeof(Brick) + sizeof(float) * cells_per_octant * static_cast<std::size_t>(__builtin_popcount(dense_mask));
}

Brick* Brick::create(std::uint8_t dense_mask) {
  auto* brick = new (::operator new(bytes(dense_mask))) Brick;
  brick->dense_mask = dense_mask;
  return brick;
}

void Brick::destroy(Brick* brick) {
  brick->~Brick();
  ::operator delete(brick);
}

float Brick::max_log_odds() const {
  float value = -std::numeric_limits<float>::infinity();
  for (int i = 0; i < 8; ++i) {
    if (known[i]) value = std::max(value, octant_max[i]);
  }
  return value;
}

float Brick::min_log_odds() const {
  float value = std::numeric_limits<float>::infinity();
  for (int i = 0; i < 8; ++i) {
    if (known[i]) value = std::min(value, octant_min[i]);
  }
  return value;
}

bool Brick::any_unknown() const {
  std::uint64_t all = ~std::uint64_t{0};
  for (const std::uint64_t k : known) all &= k;
  return ~all != 0;
}

OpenBrick OpenBrick::of(const Child& slot) {
  OpenBrick open;
  if (slot.is_leaf()) {
    std::fill(std::begin(open.known), std::end(open.known), ~std::uint64_t{0});
    std::fill(std::begin(open.log_odds), std::end(open.log_odds), slot.leaf_log_odds());
  } else if (!slot.is_unknown()) {
    const Brick& brick = *slot.brick();
    for (int i = 0; i < 8; ++i) {
      open.known[i] = brick.known[i];
      float* cells = open.log_odds + cells_per_octant * i;
      if (brick.is_dense(i)) {
        std::copy_n(brick.cells(i), cells_per_octant, cells);
      } else if (brick.known[i]) {
        std::fill_n(cells, cells_per_octant, brick.octant_max[i]);
      }
    }
  }
  return open;
}

Child OpenBrick::close() const {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  float octant_max[8], octant_min[8];
  std::uint8_t dense_mask = 0, uniform_mask = 0;
  for (int i = 0; i < 8; ++i) {
    octant_max[i] = -infinity;
    octant_min[i] = infinity;
    for (int c = 0; c < cells_per_octant; ++c) {
      if (!(known[i] >> c & 1)) continue;
      octant_max[i] = std::max(octant_max[i], log_odds[cells_per_octant * i + c]);
      octant_min[i] = std::min(octant_min[i], log_odds[cells_per_octant * i + c]);
    }
    const bool uniform = ~known[i] == 0 && octant_max[i] == octant_min[i];
    if (uniform) uniform_mask |= static_cast<std::uint8_t>(1u << i);
    if (known[i] && !uniform) dense_mask |= static_cast<std::uint8_t>(1u << i);
  }
  const bool all_equal =
      uniform_mask == 0xff && std::all_of(octant_max, octant_max + 8, [&](float v) { return v == octant_max[0]; });
  if (all_equal) return Child::leaf(octant_max[0]);
  if (!dense_mask && !uniform_mask) return Child();

  Brick* brick = Brick::create(dense_mask);
  for (int i = 0; i < 8; ++i) {
    brick->known[i] = known[i];
    if (!known[i]) continue;
    brick->octant_max[i] = octant_max[i];
    brick->octant_min[i] = octant_min[i];
    if (!brick->is_dense(i)) continue;
    for (int c = 0; c < cells_per_octant; ++c) {
      brick->cells(i)[c] = known[i] >> c & 1 ? log_odds[cells_per_octant * i + c] : 0.0f;
    }
  }
  return Child::adopt(brick);
}

}  // namespace rayvox
