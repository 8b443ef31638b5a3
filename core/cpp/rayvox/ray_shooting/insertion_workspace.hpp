#pragma once
#include <cstddef>
#include <memory>
#include <vector>

#include "rayvox/ray_shooting/beam_tile.hpp"
#include "rayvox/ray_shooting/direction_index.hpp"
#include "rayvox/ray_shooting/tile_bins.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// Scratch memory of one insertion: what each worker needs, and the sorted rays.
struct InsertionWorkspace {
  std::vector<TileBins> bins;
  std::vector<std::unique_ptr<TileMarks>> marks;
  std::vector<std::unique_ptr<BeamScratch>> beams;
  DirectionIndex directions;

  std::size_t bytes() const;
};

/// Borrows a workspace for the time of one insertion. Those given back are kept, for whichever map inserts next: memory
/// that the system has already handed out costs a small scan less than new memory. One that grew beyond 64 MiB is
/// freed.
class WorkspaceLease {
 public:
  /// Empty bins, marks and masks for each of `workers`.
  explicit WorkspaceLease(int workers);
  ~WorkspaceLease();
  WorkspaceLease(const WorkspaceLease&) = delete;
  WorkspaceLease& operator=(const WorkspaceLease&) = delete;

  InsertionWorkspace& operator*() const { return *workspace_; }
  InsertionWorkspace* operator->() const { return workspace_.get(); }

 private:
  std::unique_ptr<InsertionWorkspace> workspace_;
};

}  // namespace rayvox
