#include "rayvox/ray_shooting/insertion_workspace.hpp"

#include <exception>
#include <mutex>
#include <utility>

namespace rayvox {
namespace {

constexpr std::size_t most_bytes_kept = std::size_t{64} << 20;

struct Pool {
  std::mutex mutex;
  std::vector<std::unique_ptr<InsertionWorkspace>> idle;
};

// Never destroyed: threads may still insert while the process ends.
Pool& pool() {
  static Pool& instance = *new Pool;
  return instance;
}

}  // namespace

std::size_t InsertionWorkspace::bytes() const {
  std::size_t total = marks.size() * sizeof(TileMarks) + beams.size() * sizeof(BeamScratch) + directions.bytes();
  for (const auto& beam : beams) {
    total += beam->segments.capacity() * sizeof(Segment) + beam->bricks.capacity() * sizeof(BeamScratch::WantedBrick);
  }
  for (const TileBins& worker : bins) total += worker.bytes();
  return total;
}

WorkspaceLease::WorkspaceLease(int workers) {
  {
    std::lock_guard lock(pool().mutex);
    if (!pool().idle.empty()) {
      workspace_ = std::move(pool().idle.back());
      pool().idle.pop_back();
    }
  }
  if (!workspace_) workspace_ = std::make_unique<InsertionWorkspace>();
  const auto count = static_cast<std::size_t>(workers);
  workspace_->bins.resize(count);
  for (TileBins& bins : workspace_->bins) bins.clear();
  while (workspace_->marks.size() < count) workspace_->marks.push_back(std::make_unique<TileMarks>());
  while (workspace_->beams.size() < count) workspace_->beams.push_back(std::make_unique<BeamScratch>());
}

WorkspaceLease::~WorkspaceLease() {
  // An insertion that failed may leave marks behind.
  if (std::uncaught_exceptions() > 0 || workspace_->bytes() > most_bytes_kept) return;
  std::lock_guard lock(pool().mutex);
  pool().idle.push_back(std::move(workspace_));
}

}  // namespace rayvox
