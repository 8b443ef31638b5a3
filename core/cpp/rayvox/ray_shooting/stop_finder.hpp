#pragma once
#include <algorithm>
#include <array>
#include <bit>

#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// Finds, for one cell of a ray after another, what stops the ray there or how far around nothing does. Whole nodes are
/// passed by their summaries, and a search goes up only as far as two cells' paths differ.
class StopFinder {
 public:
  enum class Kind : std::uint8_t { none, occupied, unknown };
  /// `none`: nothing in the node of 2^level cells around the cell stops the ray.
  struct Stop {
    Kind kind;
    int level;
  };

  StopFinder(const MapSnapshot& map, bool unknown_stops)
      : threshold_(map.model.occupied_log_odds),
        unknown_stops_(unknown_stops),
        half_extent_(map.geometry.half_extent()),
        level_(map.geometry.depth()) {
    path_[static_cast<std::size_t>(level_)] = &map.root;
  }

  Stop find(const Cell& cell) {
    const std::uint32_t at[3] = {place(cell[0]), place(cell[1]), place(cell[2])};
    const int shared = std::bit_width((at[0] ^ last_[0]) | (at[1] ^ last_[1]) | (at[2] ^ last_[2]));
    std::copy(std::begin(at), std::end(at), last_);
    level_ = std::max(level_, shared);
    for (;;) {
      const Child& slot = *path_[static_cast<std::size_t>(level_)];
      switch (slot.kind()) {
        case Child::Kind::unknown: return unknown(level_);
        case Child::Kind::leaf: return known(slot.leaf_log_odds(), level_);
        case Child::Kind::brick: return find_in(*slot.brick(), at);
        case Child::Kind::inner: break;
      }
      const InnerNode& node = *slot.inner();
      if (passable(node.summary.max_log_odds, node.summary.any_unknown)) return {Kind::none, level_};
      --level_;
      path_[static_cast<std::size_t>(level_)] = &node.child[child_index(at, level_)];
    }
  }

 private:
  std::uint32_t place(std::int32_t coordinate) const { return static_cast<std::uint32_t>(coordinate + half_extent_); }
  static std::uint32_t child_index(const std::uint32_t (&at)[3], int level) {
    return (at[0] >> level & 1) | (at[1] >> level & 1) << 1 | (at[2] >> level & 1) << 2;
  }
  bool passable(float max_log_odds, bool any_unknown) const {
    return max_log_odds < threshold_ && !(any_unknown && unknown_stops_);
  }
  Stop unknown(int level) const { return {unknown_stops_ ? Kind::unknown : Kind::none, level}; }
  Stop known(float log_odds, int level) const { return {log_odds >= threshold_ ? Kind::occupied : Kind::none, level}; }

  Stop find_in(const Brick& brick, const std::uint32_t (&at)[3]) const {
    constexpr int octant_level = 2;
    const auto octant = static_cast<int>(child_index(at, octant_level));
    if (brick.is_unknown(octant)) return unknown(octant_level);
    if (passable(brick.octant_max[octant], ~brick.known[octant] != 0)) return {Kind::none, octant_level};
    if (!brick.is_dense(octant)) return known(brick.octant_max[octant], octant_level);
    const std::uint32_t cell = child_index(at, 1) << 3 | child_index(at, 0);
    if (!(brick.known[octant] >> cell & 1)) return unknown(0);
    return known(brick.cells(octant)[cell], 0);
  }

  const float threshold_;
  const bool unknown_stops_;
  const std::int32_t half_extent_;
  int level_;  // the lowest of path_; above it path_ holds its ancestors
  std::uint32_t last_[3] = {};
  std::array<const Child*, max_depth + 1> path_;
};

}  // namespace rayvox
