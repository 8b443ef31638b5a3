#include "rayvox/collision/collide.hpp"

#include <algorithm>
#include <memory>
#include <string>

#include "rayvox/collision/pair_collider.hpp"
#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t poses_per_task = 32;

RigidTransform pose_at(std::span<const double> poses, std::size_t index) {
  try {
    return RigidTransform::from_matrix(poses.data() + 16 * index);
  } catch (const InvalidInput& error) {
    throw InvalidInput("T_a_b[" + std::to_string(index) + "]: " + error.what());
  }
}

}  // namespace

CollideResult collide(const KdopBvh& a, const KdopBvh& b, std::span<const double> poses,
                      const CollideOptions& options) {
  const PairTables tables(a, b, options.kernels ? *options.kernels : collision_kernels());
  const Solid solid_a(a), solid_b(b);
  const std::size_t count = poses.size() / 16;
  CollideResult result;
  result.state.resize(count);
  if (options.statistics) result.statistics.resize(count);
  std::vector<std::unique_ptr<PairCollider>> colliders(static_cast<std::size_t>(thread_count()));
  parallel_for((count + poses_per_task - 1) / poses_per_task, static_cast<int>(colliders.size()),
               [&](std::size_t task, int worker) {
                 auto& collider = colliders[static_cast<std::size_t>(worker)];
                 if (!collider) collider = std::make_unique<PairCollider>(tables, solid_a, solid_b, options);
                 for (std::size_t i = task * poses_per_task; i < std::min(count, (task + 1) * poses_per_task); ++i) {
                   result.state[i] = collider->collide(static_cast<std::uint32_t>(i), pose_at(poses, i));
                   if (options.statistics) result.statistics[i] = collider->counts();
                 }
               });
  for (const auto& collider : colliders) {
    if (collider)
      result.contacts.insert(result.contacts.end(), collider->contacts().begin(), collider->contacts().end());
  }
  std::stable_sort(result.contacts.begin(), result.contacts.end(),
                   [](const Contact& x, const Contact& y) { return x.pose < y.pose; });
  return result;
}

}  // namespace rayvox
