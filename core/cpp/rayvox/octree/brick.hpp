#pragma once
// A brick is the octree's lowest three levels, 8x8x8 cells in Morton order, as eight octants of 4x4x4. An octant that
// is wholly unknown or uniform stores no cells; the others ("dense") store 64 log-odds each behind the header, so a
// brick costs 144 bytes and 256 per dense octant.
//
// Invariants: cells that are unknown inside a dense octant hold 0; a dense octant is neither wholly unknown nor known
// and uniform; a brick is neither wholly unknown nor known and uniform (its slot would then be unknown or a leaf).
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "rayvox/octree/child.hpp"

namespace rayvox {

constexpr int cells_per_octant = 64;
constexpr int cells_per_brick = 512;

struct Brick {
  std::atomic<std::uint32_t> references{1};
  std::uint8_t dense_mask = 0;  // bit i: octant i stores its cells
  std::uint64_t known[8] = {};  // bit c of known[i]: cell c of octant i has been observed
  float octant_max[8] = {};     // over known cells; equal to octant_min in a uniform octant
  float octant_min[8] = {};

  /// A brick with room for the dense octants of `dense_mask`, all else zero.
  static Brick* create(std::uint8_t dense_mask);
  static void destroy(Brick* brick);
  static std::size_t bytes(std::uint8_t dense_mask);

  bool is_dense(int octant) const { return dense_mask >> octant & 1; }
  bool is_unknown(int octant) const { return known[octant] == 0; }
  /// Log-odds of the 64 cells of a dense octant.
  float* cells(int octant) { return reinterpret_cast<float*>(this + 1) + cells_per_octant * dense_rank(octant); }
  const float* cells(int octant) const { return const_cast<Brick*>(this)->cells(octant); }
  /// Log-odds of a known cell; the octant may be dense or uniform.
  float log_odds(int octant, int cell) const { return is_dense(octant) ? cells(octant)[cell] : octant_max[octant]; }

  float max_log_odds() const;
  float min_log_odds() const;
  bool any_unknown() const;

 private:
  int dense_rank(int octant) const { return __builtin_popcount(dense_mask & ((1u << octant) - 1)); }
};

/// The 512 cells of a brick slot laid open, for edits that are not a scan.
struct OpenBrick {
  std::uint64_t known[8] = {};
  alignas(64) float log_odds[cells_per_brick] = {};

  /// Lays open an unknown, leaf or brick slot.
  static OpenBrick of(const Child& slot);
  /// The canonical slot with these cells: unknown, leaf or brick.
  Child close() const;
};

}  // namespace rayvox
