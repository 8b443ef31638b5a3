#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/collision/pair_collider.hpp"

namespace rayvox {

/// Pairs of a robot's links that must not touch each other. Immutable.
class SelfCollision {
 public:
  using LinkPair = std::pair<std::uint32_t, std::uint32_t>;

  /// links: null for one without geometry. Throws InvalidInput for a pair that names no two links with geometry, and
  /// for hierarchies built differently.
  SelfCollision(std::vector<std::shared_ptr<const KdopBvh>> links, const std::vector<LinkPair>& pairs);
  SelfCollision(const SelfCollision&) = delete;
  SelfCollision& operator=(const SelfCollision&) = delete;

  /// Whether, with the links placed by `T_map_links` (row-major 4x4, one per link, pose after pose, rigid as
  /// KinematicTree gives them), two links of a pair touch or one encloses the other: a byte a pose. All threads. Throws
  /// InvalidInput where two links that are near each other have no rigid transform between them.
  std::vector<std::uint8_t> check(std::span<const double> T_map_links) const;

 private:
  friend class SelfCollisionQuery;
  struct Pair {
    std::uint32_t a, b;
    std::unique_ptr<PairTables> tables;
  };

  std::vector<std::shared_ptr<const KdopBvh>> links_;
  std::vector<std::unique_ptr<Solid>> solids_;  // of links
  std::vector<Pair> pairs_;
  CollideOptions options_;
};

}  // namespace rayvox
