#include "rayvox/robot/self_filter.hpp"

#include <algorithm>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t points_per_task = 1024;

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// A link at its pose. Everything is asked in the link's own frame.
class PlacedLink {
 public:
  PlacedLink(const FilterLink& link, const double* T, const Vec3d& origin_m)
      : link_(link),
        reach_(link.extent.radius_m + link.padding_m),
        columns_{{T[0], T[4], T[8]}, {T[1], T[5], T[9]}, {T[2], T[6], T[10]}},
        position_{T[3], T[7], T[11]},
        origin_(to_link(origin_m)),
        holds_origin_(holds(origin_)) {}

  Vec3d to_link(const Vec3d& p) const {
    const Vec3d d = p - position_;
    return {dot(columns_[0], d), dot(columns_[1], d), dot(columns_[2], d)};
  }

  bool holds(const Vec3d& p) const {
    return near_axis(p) && (link_.mesh->touches(p, link_.padding_m) || link_.mesh->inside(p));
  }

  bool stops_ray_to(const Vec3d& p) const {
    return !holds_origin_ && segment_nears_axis(p) && link_.mesh->touches(origin_, p, link_.padding_m);
  }

 private:
  bool near_axis(const Vec3d& p) const {
    const Vec3d d = link_.extent.to - link_.extent.from, w = p - link_.extent.from;
    const double length2 = dot(d, d), t = length2 > 0 ? std::clamp(dot(w, d) / length2, 0.0, 1.0) : 0.0;
    const Vec3d gap = w - d * t;
    return dot(gap, gap) <= reach_ * reach_;
  }

  // The ball around the capsule, which one projection decides.
  bool segment_nears_axis(const Vec3d& p) const {
    const Vec3d centre = (link_.extent.from + link_.extent.to) * 0.5, d = p - origin_, w = centre - origin_;
    const double length2 = dot(d, d), t = length2 > 0 ? std::clamp(dot(w, d) / length2, 0.0, 1.0) : 0.0;
    const Vec3d gap = w - d * t;
    const double radius = reach_ + 0.5 * norm(link_.extent.to - link_.extent.from);
    return dot(gap, gap) <= radius * radius;
  }

  const FilterLink& link_;
  double reach_;
  Vec3d columns_[3], position_, origin_;
  bool holds_origin_;
};

}  // namespace

void filter_body(const std::vector<FilterLink>& links, const double* T_frame_links, const PointsView& points,
                 const Vec3d& origin_m, std::uint8_t* out) {
  if (!is_finite(origin_m)) throw InvalidInput("origin is not finite");
  std::vector<PlacedLink> placed;
  for (std::size_t i = 0; i < links.size(); ++i) {
    RigidTransform::from_matrix(T_frame_links + 16 * i);
    if (links[i].mesh) placed.emplace_back(links[i], T_frame_links + 16 * i, origin_m);
  }
  for (std::size_t i = 0; i < points.count; ++i) {
    if (!is_finite(points[i])) throw InvalidInput("points[" + std::to_string(i) + "] is not finite");
  }
  const std::size_t tasks = (points.count + points_per_task - 1) / points_per_task;
  parallel_for(tasks, [&](std::size_t task, int) {
    const std::size_t end = std::min(points.count, (task + 1) * points_per_task);
    for (std::size_t i = task * points_per_task; i < end; ++i) {
      std::uint8_t what = kept;
      for (std::size_t k = 0; k < placed.size() && what != on_body; ++k) {
        const Vec3d p = placed[k].to_link(points[i]);
        if (placed[k].holds(p)) {
          what = on_body;
        } else if (what == kept && placed[k].stops_ray_to(p)) {
          what = behind_body;
        }
      }
      out[i] = what;
    }
  });
}

}  // namespace rayvox
