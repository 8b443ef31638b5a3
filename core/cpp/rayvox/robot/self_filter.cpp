#include "rayvox/robot/self_filter.hpp"

#include <algorithm>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/geometry/triangle_distance.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t points_per_task = 1024;
constexpr double rounding = 1e-9;

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d row(const double* T, int i) { return {T[4 * i], T[4 * i + 1], T[4 * i + 2]}; }

/// A link at its pose. Everything is asked in the link's own frame.
class PlacedLink {
 public:
  PlacedLink(const FilterLink& link, const double* T, const Vec3d& origin_m)
      : link_(link),
        reach_(link.extent.radius_m + link.padding_m),
        columns_{{T[0], T[4], T[8]}, {T[1], T[5], T[9]}, {T[2], T[6], T[10]}},
        position_{T[3], T[7], T[11]},
        origin_(to_link(origin_m)),
        holds_origin_(holds(origin_)) {
    // A ball around the padded link, seen from the origin.
    const Vec3d centre = (link.extent.from + link.extent.to) * 0.5 - origin_;
    const double radius = reach_ + 0.5 * norm(link.extent.to - link.extent.from);
    to_centre_ = {dot(row(T, 0), centre), dot(row(T, 1), centre), dot(row(T, 2), centre)};
    tangent2_ = dot(centre, centre) - radius * radius;
  }

  /// False where the beam that goes by `beam` from the origin passes the link by far. The cone of tangents decides.
  bool in_sight(const Vec3d& beam, double length2) const {
    const double along = dot(beam, to_centre_);
    return tangent2_ <= 0 || (along > 0 && along * along >= length2 * tangent2_);
  }

  Vec3d to_link(const Vec3d& p) const {
    const Vec3d d = p - position_;
    return {dot(columns_[0], d), dot(columns_[1], d), dot(columns_[2], d)};
  }

  bool holds(const Vec3d& p) const {
    return near_axis(p) && (link_.mesh->touches(p, link_.padding_m) || link_.mesh->inside(p));
  }

  bool stops_ray_to(const Vec3d& p) const {
    return !holds_origin_ && segment_nears_axis(origin_, p) && link_.mesh->touches(origin_, p, link_.padding_m);
  }

 private:
  bool near_axis(const Vec3d& p) const { return segment_nears_axis(p, p); }

  bool segment_nears_axis(const Vec3d& from, const Vec3d& to) const {
    return squared_distance_of_segments(from, to, link_.extent.from, link_.extent.to) <= reach_ * reach_;
  }

  const FilterLink& link_;
  double reach_, tangent2_;
  Vec3d columns_[3], position_, origin_, to_centre_;
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
      const Vec3d beam = points[i] - origin_m;
      const double length2 = dot(beam, beam) * (1 - rounding);
      for (std::size_t k = 0; k < placed.size() && what != on_body; ++k) {
        if (!placed[k].in_sight(beam, length2)) continue;
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
