#pragma once
#include <cstddef>
#include <memory>
#include <vector>

#include "rayvox/ray_shooting/tile_bins.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// Scratch memory of one insertion: bins and marks per worker.
struct InsertionWorkspace {
  std::vector<TileBins> bins;
  std::vector<std::unique_ptr<TileMarks>> marks;

  std::size_t bytes() const;
};

/// Borrows a workspace for the time of one insertion. Those given back are kept, for whichever map inserts next: memory
/// that the system has already handed out costs a small scan less than new memory. One that grew beyond 64 MiB is
/// freed.
class WorkspaceLease {
 public:
  /// Empty bins and unmarked marks for each of `workers`.
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
