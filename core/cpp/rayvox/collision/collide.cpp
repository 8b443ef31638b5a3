#include "rayvox/collision/collide.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "rayvox/collision/relative_placement.hpp"
#include "rayvox/collision/solid.hpp"
#include "rayvox/collision/triangle.hpp"
#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t poses_per_task = 32;

// One thread's traversals, and its answers to the kernels' questions.
class Collider {
 public:
  Collider(const PairTables& tables, const Solid& solid_a, const Solid& solid_b, const CollideOptions& options)
      : tables_(tables), solid_a_(solid_a), solid_b_(solid_b), options_(options), stack_(tables.stack_capacity()) {
    query_ = {
        .a = tables.a().view(),
        .b = tables.b().view(),
        .pose = &pose_,
        .stack = stack_.data(),
        .context = this,
        .touch = [](void* self, std::uint32_t a, std::uint32_t b) { return static_cast<Collider*>(self)->touch(a, b); },
        .contact = [](void* self, std::uint32_t a,
                      std::uint32_t b) { return static_cast<Collider*>(self)->contact(a, b); },
        .counts = &counts_};
  }
  Collider(const Collider&) = delete;

  std::uint8_t collide(std::uint32_t pose_index, const RigidTransform& T_a_b) {
    counts_ = {};
    const std::optional<Placement> placement = tables_.place(T_a_b);
    if (!placement) return CollideResult::apart;
    placement_ = *placement;
    tables_.prepare(placement_, pose_);
    pose_index_ = pose_index;
    found_ = false;
    const std::size_t before = contacts_.size();
    tables_.kernels().traverse[static_cast<int>(tables_.a().options().traversal)](query_);
    std::sort(contacts_.begin() + static_cast<std::ptrdiff_t>(before), contacts_.end(),
              [](const auto& x, const auto& y) {
                return x.triangle_a != y.triangle_a ? x.triangle_a < y.triangle_a : x.triangle_b < y.triangle_b;
              });
    if (found_) return CollideResult::surfaces_touch;
    return options_.solids && one_contains_the_other() ? CollideResult::contained : CollideResult::apart;
  }

  const TraversalCounts& counts() const { return counts_; }
  std::vector<Contact>& contacts() { return contacts_; }

 private:
  bool touch(std::uint32_t a, std::uint32_t b) const {
    Triangle moved = tables_.b().mesh().triangle(tables_.b().triangle_at(b));
    for (Vec3d& corner : moved) corner = placement_.apply(corner);
    return triangles_touch(tables_.a().mesh().triangle(tables_.a().triangle_at(a)), moved);
  }

  bool contact(std::uint32_t a, std::uint32_t b) {
    found_ = true;
    if (options_.contacts == Contacts::none) return true;
    contacts_.push_back({pose_index_, tables_.a().triangle_at(a), tables_.b().triangle_at(b)});
    return options_.contacts == Contacts::first;
  }

  bool one_contains_the_other() const {
    if (solid_a_.contains_component_of(tables_.b().mesh(), [&](const Vec3d& p) { return placement_.apply(p); }))
      return true;
    const double *r = pose_.a_to_b.rotation, *t = pose_.a_to_b.translation;
    return solid_b_.contains_component_of(tables_.a().mesh(), [&](const Vec3d& p) {
      return Vec3d{r[0] * p.x + r[1] * p.y + r[2] * p.z + t[0], r[3] * p.x + r[4] * p.y + r[5] * p.z + t[1],
                   r[6] * p.x + r[7] * p.y + r[8] * p.z + t[2]};
    });
  }

  const PairTables& tables_;
  const Solid &solid_a_, &solid_b_;
  const CollideOptions& options_;
  std::vector<std::uint64_t> stack_;
  TraversalQuery query_;
  RelativePose pose_;
  Placement placement_;
  TraversalCounts counts_;
  std::vector<Contact> contacts_;
  std::uint32_t pose_index_ = 0;
  bool found_ = false;
};

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
  std::vector<std::unique_ptr<Collider>> colliders(static_cast<std::size_t>(thread_count()));
  parallel_for((count + poses_per_task - 1) / poses_per_task, static_cast<int>(colliders.size()),
               [&](std::size_t task, int worker) {
                 auto& collider = colliders[static_cast<std::size_t>(worker)];
                 if (!collider) collider = std::make_unique<Collider>(tables, solid_a, solid_b, options);
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
