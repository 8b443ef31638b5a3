#include "rayvox/map_collision/check_poses.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/map_collision/octree_descent.hpp"
#include "rayvox/map_collision/placed_body.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t poses_per_task = 16;

RigidTransform pose_at(std::span<const double> T_map_links, std::size_t pose, std::size_t link, std::size_t links) {
  try {
    return RigidTransform::from_matrix(T_map_links.data() + 16 * (pose * links + link));
  } catch (const InvalidInput& error) {
    throw InvalidInput("T_map_links[" + std::to_string(pose) + "][" + std::to_string(link) + "]: " + error.what());
  }
}

const CollisionKernels& kernels_of(const MapCheckOptions& options) {
  return options.kernels ? *options.kernels : collision_kernels();
}

// One thread's bodies, placed at one pose after the other.
class Checker {
 public:
  Checker(const MapSnapshot& map, std::span<const MapCheckLink> links, const MapCheckOptions& options)
      : links_(links), options_(options), descent_(map, options, kernels_of(options)) {
    for (std::uint32_t i = 0; i < links.size(); ++i) {
      if (!links[i].body) continue;
      bodies_.emplace_back(*links[i].body, map.geometry, kernels_of(options));
      order_.push_back(link_of_.size());
      link_of_.push_back(i);
    }
  }

  MapVerdict check(std::size_t pose, std::span<const double> T_map_links) {
    descent_.start_pose(static_cast<std::uint32_t>(pose));
    for (std::size_t i = 0; i < order_.size(); ++i) {
      const std::size_t body = order_[i];
      const std::uint32_t link = link_of_[body];
      bodies_[body].place(pose_at(T_map_links, pose, link, links_.size()), padding_m(pose, link));
      if (!descent_.check_link(bodies_[body], link)) continue;
      // Poses come in sequences: of those that collide, the link that did is asked first the next time.
      const auto at = order_.begin() + static_cast<std::ptrdiff_t>(i);
      if (options_.contacts == Contacts::none) std::rotate(order_.begin(), at, at + 1);
      break;
    }
    return descent_.verdict();
  }

  std::vector<VoxelContact>& contacts() { return descent_.contacts(); }

 private:
  double padding_m(std::size_t pose, std::uint32_t link) const {
    const double more = options_.more_padding_m.empty() ? 0 : options_.more_padding_m[pose * links_.size() + link];
    return links_[link].padding_m + more;
  }

  std::span<const MapCheckLink> links_;
  const MapCheckOptions& options_;
  OctreeDescent descent_;
  std::vector<PlacedBody> bodies_;
  std::vector<std::uint32_t> link_of_;  // of bodies
  std::vector<std::size_t> order_;      // of bodies, as they are asked
};

bool is_padding(double padding_m) { return padding_m >= 0 && std::isfinite(padding_m); }

void require_valid(std::span<const MapCheckLink> links, std::span<const double> T_map_links,
                   const MapCheckOptions& options) {
  if (links.empty() || T_map_links.size() % (16 * links.size()) != 0) {
    throw InvalidInput("a pose needs one 4x4 matrix for each of " + std::to_string(links.size()) + " links");
  }
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (!is_padding(links[i].padding_m)) {
      throw InvalidInput("padding of link " + std::to_string(i) + " must be finite and at least 0");
    }
  }
  const std::span<const double> more = options.more_padding_m;
  if (!more.empty() && (16 * more.size() != T_map_links.size() || !std::all_of(more.begin(), more.end(), is_padding))) {
    throw InvalidInput("paddings must be finite and at least 0, one per pose and link");
  }
}

}  // namespace

MapCheckResult check_poses(const MapSnapshot& map, std::span<const MapCheckLink> links,
                           std::span<const double> T_map_links, const MapCheckOptions& options) {
  require_valid(links, T_map_links, options);
  const std::size_t count = T_map_links.size() / (16 * links.size());
  const std::size_t tasks = (count + poses_per_task - 1) / poses_per_task;
  const int workers = static_cast<int>(std::min<std::size_t>(tasks, static_cast<std::size_t>(thread_count())));
  MapCheckResult result;
  result.verdict.resize(count);
  std::vector<std::unique_ptr<Checker>> checkers(static_cast<std::size_t>(std::max(workers, 1)));
  std::vector<std::vector<VoxelContact>> contacts(tasks);
  parallel_for(tasks, std::max(workers, 1), [&](std::size_t task, int worker) {
    if (options.cancellation) options.cancellation->throw_if_cancelled();
    std::unique_ptr<Checker>& checker = checkers[static_cast<std::size_t>(worker)];
    if (!checker) checker = std::make_unique<Checker>(map, links, options);
    for (std::size_t i = task * poses_per_task; i < std::min(count, (task + 1) * poses_per_task); ++i) {
      result.verdict[i] = static_cast<std::uint8_t>(checker->check(i, T_map_links));
    }
    contacts[task].swap(checker->contacts());
  });
  for (const auto& part : contacts) result.contacts.insert(result.contacts.end(), part.begin(), part.end());
  return result;
}

}  // namespace rayvox
