#include "rayvox/collision/pair_collider.hpp"

#include <algorithm>
#include <optional>

#include "rayvox/collision/triangle.hpp"

namespace rayvox {

PairCollider::PairCollider(const PairTables& tables, const Solid& solid_a, const Solid& solid_b,
                           const CollideOptions& options)
    : tables_(tables), solid_a_(solid_a), solid_b_(solid_b), options_(options), stack_(tables.stack_capacity()) {
  query_ = {.a = tables.a().view(),
            .b = tables.b().view(),
            .pose = &pose_,
            .stack = stack_.data(),
            .context = this,
            .touch = [](void* self, std::uint32_t a,
                        std::uint32_t b) { return static_cast<PairCollider*>(self)->touch(a, b); },
            .contact = [](void* self, std::uint32_t a,
                          std::uint32_t b) { return static_cast<PairCollider*>(self)->contact(a, b); },
            .counts = &counts_};
}

std::uint8_t PairCollider::collide(std::uint32_t pose_index, const RigidTransform& T_a_b) {
  counts_ = {};
  const std::optional<Placement> placement = tables_.place(T_a_b);
  if (!placement) return CollideResult::apart;
  placement_ = *placement;
  tables_.prepare(placement_, pose_);
  pose_index_ = pose_index;
  found_ = false;
  const auto before = static_cast<std::ptrdiff_t>(contacts_.size());
  tables_.kernels().traverse[static_cast<int>(tables_.a().options().traversal)](query_);
  std::sort(contacts_.begin() + before, contacts_.end(), [](const auto& x, const auto& y) {
    return x.triangle_a != y.triangle_a ? x.triangle_a < y.triangle_a : x.triangle_b < y.triangle_b;
  });
  if (found_) return CollideResult::surfaces_touch;
  return options_.solids && one_contains_the_other() ? CollideResult::contained : CollideResult::apart;
}

bool PairCollider::touch(std::uint32_t a, std::uint32_t b) const {
  Triangle moved = tables_.b().mesh().triangle(tables_.b().triangle_at(b));
  for (Vec3d& corner : moved) corner = placement_.apply(corner);
  return triangles_touch(tables_.a().mesh().triangle(tables_.a().triangle_at(a)), moved);
}

bool PairCollider::contact(std::uint32_t a, std::uint32_t b) {
  found_ = true;
  if (options_.contacts == Contacts::none) return true;
  contacts_.push_back({pose_index_, tables_.a().triangle_at(a), tables_.b().triangle_at(b)});
  return options_.contacts == Contacts::first;
}

bool PairCollider::one_contains_the_other() const {
  if (solid_a_.contains_component_of(tables_.b().mesh(), [&](const Vec3d& p) { return placement_.apply(p); }))
    return true;
  const double *r = pose_.a_to_b.rotation, *t = pose_.a_to_b.translation;
  return solid_b_.contains_component_of(tables_.a().mesh(), [&](const Vec3d& p) {
    return Vec3d{r[0] * p.x + r[1] * p.y + r[2] * p.z + t[0], r[3] * p.x + r[4] * p.y + r[5] * p.z + t[1],
                 r[6] * p.x + r[7] * p.y + r[8] * p.z + t[2]};
  });
}

}  // namespace rayvox
