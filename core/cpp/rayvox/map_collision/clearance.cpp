#include "rayvox/map_collision/clearance.hpp"

#include <algorithm>
#include <memory>

#include "rayvox/error.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/map_collision/clearance_search.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

// One thread's bodies, placed at one pose after the other.
class Measurer {
 public:
  Measurer(const MapSnapshot& map, std::span<const MapCheckLink> links, const ClearanceOptions& options)
      : links_(links), search_(map, options) {
    const CollisionKernels& kernels = options.kernels ? *options.kernels : collision_kernels();
    for (std::uint32_t i = 0; i < links.size(); ++i) {
      if (!links[i].body) continue;
      bodies_.emplace_back(*links[i].body, map.geometry, kernels);
      link_of_.push_back(i);
    }
  }

  PoseClearance measure(std::size_t pose, std::span<const double> T_map_links) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const double* T_map_link = T_map_links.data() + 16 * (pose * links_.size() + link_of_[i]);
      bodies_[i].place(RigidTransform::from_matrix(T_map_link), links_[link_of_[i]].padding_m);
    }
    PoseClearance nearest = search_.nearest_voxel(bodies_);
    if (nearest.link >= 0) {
      nearest.link = static_cast<std::int32_t>(link_of_[static_cast<std::size_t>(nearest.link)]);
    }
    return nearest;
  }

 private:
  std::span<const MapCheckLink> links_;
  ClearanceSearch search_;
  std::vector<PlacedBody> bodies_;
  std::vector<std::uint32_t> link_of_;
};

}  // namespace

std::vector<PoseClearance> measure_clearances(const MapSnapshot& map, std::span<const MapCheckLink> links,
                                              std::span<const double> T_map_links, const ClearanceOptions& options) {
  if (!(options.max_clearance_m > 0)) throw InvalidInput("max_clearance_m must be above 0");
  const MapCheckOptions check{.unknown_is_occupied = options.unknown_is_occupied,
                              .occupied_log_odds = options.occupied_log_odds,
                              .kernels = options.kernels,
                              .cancellation = options.cancellation};
  const std::vector<std::uint8_t> verdict = check_poses(map, links, T_map_links, check).verdict;
  std::vector<PoseClearance> clearances(verdict.size());
  const auto workers =
      std::max(1, static_cast<int>(std::min<std::size_t>(verdict.size(), static_cast<std::size_t>(thread_count()))));
  std::vector<std::unique_ptr<Measurer>> measurers(static_cast<std::size_t>(workers));
  parallel_for(verdict.size(), workers, [&](std::size_t pose, int worker) {
    if (options.cancellation) options.cancellation->throw_if_cancelled();
    const auto met = static_cast<MapVerdict>(verdict[pose]);
    if (met != MapVerdict::free) {
      clearances[pose].verdict = met;
      return;
    }
    std::unique_ptr<Measurer>& measurer = measurers[static_cast<std::size_t>(worker)];
    if (!measurer) measurer = std::make_unique<Measurer>(map, links, options);
    clearances[pose] = measurer->measure(pose, T_map_links);
  });
  return clearances;
}

}  // namespace rayvox
