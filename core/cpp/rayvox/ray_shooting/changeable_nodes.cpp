#include "rayvox/ray_shooting/changeable_nodes.hpp"

#include <algorithm>
#include <bit>

#include "rayvox/octree/box.hpp"

namespace rayvox {
namespace {

constexpr int octant_level = 2;
constexpr int word_level = 4;  // 64 octants

int octants_of(int level) { return 1 << (3 * (level - octant_level)); }

// The bits of a node below word level, within its word.
std::uint64_t bits_of(int level, int first_octant) {
  const std::uint64_t ones = (std::uint64_t{1} << octants_of(level)) - 1;
  return ones << (first_octant % 64);
}

}  // namespace

OctantSet OctantSet::changeable(const Child& slot, int tile_level, float clamp_min_log_odds) {
  OctantSet found;
  found.collect(slot, tile_level, 0, clamp_min_log_odds);
  return found;
}

void OctantSet::set(int level, int first_octant) {
  if (level >= word_level) {
    std::fill_n(words_ + first_octant / 64, octants_of(level) / 64, ~std::uint64_t{0});
  } else {
    words_[first_octant / 64] |= bits_of(level, first_octant);
  }
}

void OctantSet::collect(const Child& slot, int level, int first_octant, float clamp_min_log_odds) {
  switch (slot.kind()) {
    case Child::Kind::unknown: set(level, first_octant); break;
    case Child::Kind::leaf:
      if (slot.leaf_log_odds() > clamp_min_log_odds) set(level, first_octant);
      break;
    case Child::Kind::inner: {
      const InnerNode& node = *slot.inner();
      if (!node.summary.any_unknown && node.summary.max_log_odds <= clamp_min_log_odds) break;
      for (int i = 0; i < 8; ++i) {
        collect(node.child[i], level - 1, first_octant + i * octants_of(level - 1), clamp_min_log_odds);
      }
      break;
    }
    case Child::Kind::brick: {
      const Brick& brick = *slot.brick();
      for (int i = 0; i < 8; ++i) {
        const bool saturated = ~brick.known[i] == 0 && brick.octant_max[i] <= clamp_min_log_odds;
        if (!saturated) set(octant_level, first_octant + i);
      }
    }
  }
}

bool OctantSet::contains(const OctantSet& other) const {
  return std::equal(std::begin(words_), std::end(words_), other.words_,
                    [](std::uint64_t own, std::uint64_t others) { return (others & ~own) == 0; });
}

int OctantSet::count() const {
  int total = 0;
  for (const std::uint64_t word : words_) total += std::popcount(word);
  return total;
}

OctantSet& OctantSet::operator|=(const OctantSet& other) {
  std::transform(std::begin(words_), std::end(words_), other.words_, words_, std::bit_or<>());
  return *this;
}

int OctantSet::count(int level, int first_octant) const {
  if (level < word_level) return std::popcount(words_[first_octant / 64] & bits_of(level, first_octant));
  int total = 0;
  for (int word = 0; word < octants_of(level) / 64; ++word) total += std::popcount(words_[first_octant / 64 + word]);
  return total;
}

void OctantSet::fill_nodes(int level, int tile_level) {
  for (int first = 0; first < octants_of(tile_level); first += octants_of(level)) {
    if (count(level, first)) set(level, first);
  }
}

void OctantSet::split(const Cell& first, int level, int first_octant, std::vector<ChangeableNode>& nodes) const {
  const int found = count(level, first_octant);
  if (found == 0) return;
  if (found == octants_of(level)) {
    nodes.push_back({first, level});
    return;
  }
  for (int i = 0; i < 8; ++i) {
    split(child_cell(first, level, i), level - 1, first_octant + i * octants_of(level - 1), nodes);
  }
}

std::vector<ChangeableNode> OctantSet::nodes(const Cell& tile, int tile_level) const {
  std::vector<ChangeableNode> found;
  split(tile, tile_level, 0, found);
  return found;
}

}  // namespace rayvox
