#include "rayvox/collision/solid.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "rayvox/collision/exact_predicates.hpp"

namespace rayvox {
namespace {

using Kind = MeshComponent::Kind;

struct Crossings {
  long winding = 0, count = 0;
};

// The segment from `from` to `to`, and its extent along each axis of the hierarchy.
struct Ray {
  Vec3d from, to;
  float low[KdopAxes::most_axes], high[KdopAxes::most_axes];

  Ray(const KdopBvh& bvh, const Vec3d& p, const Vec3d& q) : from(p), to(q) {
    const KdopAxes& axes = bvh.options().axes;
    const double margin = 1e-5 * (bvh.mesh().radius_m() + norm(p));
    for (int i = 0; i < axes.count(); ++i) {
      const Vec3d& a = axes[i];
      const double at_p = a.x * p.x + a.y * p.y + a.z * p.z, at_q = a.x * q.x + a.y * q.y + a.z * q.z;
      low[i] = static_cast<float>(std::min(at_p, at_q) - margin);
      high[i] = static_cast<float>(std::max(at_p, at_q) + margin);
    }
  }
};

bool may_meet(const KdopBvh& bvh, const Ray& ray, std::uint32_t index) {
  const int axes = bvh.options().axes.count();
  for (int i = 0; i < axes; ++i) {
    if (bvh.support(index, i) < static_cast<double>(ray.low[i])) return false;
    if (-bvh.support(index, axes + i) > static_cast<double>(ray.high[i])) return false;
  }
  return true;
}

// How a ray crosses a triangle: 0 if it does not, else the side it comes from; none if it passes through an edge or
// starts or ends on the plane, so that another ray must tell. A start on the triangle itself is a contact, not here.
std::optional<int> crossing(const Ray& ray, const Triangle& t) {
  const int start = orient3d(t[0], t[1], t[2], ray.from), end = orient3d(t[0], t[1], t[2], ray.to);
  if (end == 0) return is_degenerate(t) ? std::optional<int>(0) : std::nullopt;
  if (start == 0 || start == end) return 0;
  const int s0 = orient3d(ray.from, ray.to, t[0], t[1]), s1 = orient3d(ray.from, ray.to, t[1], t[2]),
            s2 = orient3d(ray.from, ray.to, t[2], t[0]);
  if (std::max({s0, s1, s2}) > 0 && std::min({s0, s1, s2}) < 0) return 0;
  if (s0 == 0 || s1 == 0 || s2 == 0) return std::nullopt;
  return start;
}

// Crossings of some components; false if the ray is not in general position.
bool cross(const KdopBvh& bvh, const Ray& ray, const std::vector<std::uint32_t>& components,
           std::vector<Crossings>& crossings) {
  const CollisionMesh& mesh = bvh.mesh();
  std::vector<std::uint32_t> waiting{0};
  while (!waiting.empty()) {
    const std::uint32_t index = waiting.back();
    waiting.pop_back();
    if (!may_meet(bvh, ray, index)) continue;
    const BvhNode& node = bvh.nodes()[index];
    for (std::uint32_t i = 0; i < node.count; ++i) {
      if (!node.is_leaf) {
        waiting.push_back(node.first + i);
        continue;
      }
      const std::uint32_t triangle = bvh.triangle_at(node.first + i);
      const auto at = std::find(components.begin(), components.end(), mesh.component_of(triangle));
      if (at == components.end()) continue;
      const std::optional<int> side = crossing(ray, mesh.triangle(triangle));
      if (!side) return false;
      if (*side == 0) continue;
      Crossings& of_component = crossings[static_cast<std::size_t>(at - components.begin())];
      of_component.winding += *side;
      ++of_component.count;
    }
  }
  return true;
}

}  // namespace

Solid::Solid(const KdopBvh& bvh) : bvh_(bvh) {
  const std::vector<MeshComponent>& components = bvh.mesh().components();
  for (std::uint32_t c = 0; c < components.size(); ++c) {
    if (components[c].kind == Kind::open) continue;
    const Box box{components[c].low(), components[c].high()};
    if (parts_.empty()) box_ = box;
    for (int axis = 0; axis < 3; ++axis) {
      box_.low[axis] = std::min(box_.low[axis], box.low[axis]);
      box_.high[axis] = std::max(box_.high[axis], box.high[axis]);
    }
    parts_.push_back({c, box});
  }
}

bool Solid::contains(const Vec3d& p) const {
  std::vector<std::uint32_t> around;
  for (const ClosedPart& part : parts_) {
    if (part.box.holds(p)) around.push_back(part.component);
  }
  return !around.empty() && one_contains(around, p);
}

bool Solid::one_contains(const std::vector<std::uint32_t>& components, const Vec3d& p) const {
  const std::vector<MeshComponent>& all = bvh_.mesh().components();
  double length = 0;  // enough to leave every box that p is in
  for (const std::uint32_t c : components) length = std::max(length, 1.1 * norm(all[c].high() - all[c].low()));
  for (int attempt = 0;; ++attempt) {
    // Directions in no special relation to any mesh; that one after the other meets an edge has no likelihood.
    const double u = 1 - 2 * std::fmod(0.5497 + 0.754877666 * attempt, 1.0);
    const double angle = 6.2831853 * std::fmod(0.3183 + 0.569840291 * attempt, 1.0), s = std::sqrt(1 - u * u);
    const Ray ray(bvh_, p, p + Vec3d{s * std::cos(angle), s * std::sin(angle), u} * length);
    std::vector<Crossings> crossings(components.size());
    if (!cross(bvh_, ray, components, crossings) && attempt < 64) continue;
    for (std::size_t i = 0; i < components.size(); ++i) {
      const bool oriented = all[components[i]].kind == Kind::oriented;
      if (oriented ? crossings[i].winding != 0 : crossings[i].count % 2 != 0) return true;
    }
    return false;
  }
}

}  // namespace rayvox
