#pragma once
#include "rayvox/octree/child.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// What one scan says of a brick: a bit per cell, octant by octant. No cell is in both.
struct BrickMarks {
  std::uint64_t free[8];
  std::uint64_t occupied[8];
};

/// Applies the marks to a brick slot (unknown, leaf or brick) and keeps it canonical: uniform octants store no cells, a
/// uniform brick becomes a leaf. A brick that a snapshot shares is replaced, not changed. Returns the number of cells
/// that changed; at zero the slot was not touched.
int update_brick(Child& slot, const BrickMarks& marks, const UpdateModel& model, const Kernels& kernels);

}  // namespace rayvox
