#include "rayvox/robot/motion_bound.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t motions_per_task = 16;
// Covers the rounding of some hundred operations on values of the bound's own size.
constexpr double rounding = 1e-12;
// Below this sine of the base's angle its axis is not known well, and is not needed.
constexpr double least_sine = 1e-4;
constexpr double identity[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

Vec3d rotated(const double* T, const Vec3d& v) {
  return {T[0] * v.x + T[1] * v.y + T[2] * v.z, T[4] * v.x + T[5] * v.y + T[6] * v.z,
          T[8] * v.x + T[9] * v.y + T[10] * v.z};
}

Vec3d position(const double* T) { return {T[3], T[7], T[11]}; }
Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// The distance to a line is convex, so over a capsule it is largest at an end of its segment, plus the radius.
struct Capsule {
  Vec3d from, to;
  double radius;

  double distance_from_axis(const Vec3d& point, const Vec3d& axis) const {
    return std::max(norm(cross(from - point, axis)), norm(cross(to - point, axis))) + radius;
  }
};

struct BaseMotion {
  double distance = 0, angle = 0;
  Vec3d axis;  // base frame; unit, or zero where it is not known

  BaseMotion(const double* from, const double* to) {
    distance = norm(position(to) - position(from));
    double r[9];  // rotation from the frame `from` to the frame `to`
    double squared = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        r[3 * i + j] = from[i] * to[j] + from[4 + i] * to[4 + j] + from[8 + i] * to[8 + j];
        squared += (r[3 * i + j] - (i == j)) * (r[3 * i + j] - (i == j));
      }
    }
    // |R - I| = 2 sqrt(2) sin(angle / 2), which is well conditioned at small angles.
    angle = 2 * std::asin(std::min(1.0, std::sqrt(squared / 8)));
    const Vec3d sine{(r[7] - r[5]) / 2, (r[2] - r[6]) / 2, (r[3] - r[1]) / 2};
    if (norm(sine) > least_sine) axis = sine * (1 / norm(sine));
  }
};

class Workspace {
 public:
  Workspace(const KinematicTree& tree, const std::vector<LinkExtent>& extents)
      : tree_(tree), extents_(extents), middle_(tree.configuration_size()), poses_(16 * tree.link_count()) {}

  void bound(const double* from, const double* to, const BaseMotion& base, double* bounds_m) {
    for (std::size_t i = 0; i < middle_.size(); ++i) middle_[i] = 0.5 * from[i] + 0.5 * to[i];
    tree_.place_links(middle_.data(), identity, poses_.data());
    for (std::size_t link = 0; link < extents_.size(); ++link) {
      bounds_m[link] = extents_[link].empty() ? 0 : path_length(link, from, to, base) * (1 + rounding);
    }
  }

 private:
  // From the link up to the base, each joint adds its speed times the farthest that the link's points get from its
  // axis: their distance at the middle of the motion plus what the joints in between add until either end (half of
  // the path so far); or, whatever the angles, the length of the chain.
  double path_length(std::size_t link, const double* from, const double* to, const BaseMotion& base) const {
    const LinkExtent& extent = extents_[link];
    const double* T = &poses_[16 * link];
    const Capsule capsule{rotated(T, extent.from) + position(T), rotated(T, extent.to) + position(T), extent.radius_m};
    double chain = std::max(norm(extent.from), norm(extent.to)) + extent.radius_m;
    double path = 0;
    for (int at = static_cast<int>(link); at >= 0;) {
      const LinkJoint& joint = tree_.joints()[static_cast<std::size_t>(at)];
      const double* T_base_link = &poses_[16 * static_cast<std::size_t>(at)];
      if (joint.motion != JointMotion::fixed) {
        const double q_from = joint.value(from), q_to = joint.value(to), turn = std::abs(q_to - q_from);
        if (joint.motion == JointMotion::prismatic) {
          path += turn;
          chain += std::max(std::abs(q_from), std::abs(q_to));
        } else if (turn > 0) {
          const double near = capsule.distance_from_axis(position(T_base_link), rotated(T_base_link, joint.axis));
          path += turn * std::min(near + 0.5 * path, chain);
        }
      }
      chain += norm(position(joint.T_parent_joint.data()));
      at = joint.parent;
    }
    const double near = norm(base.axis) > 0 ? capsule.distance_from_axis({}, base.axis)
                                            : std::max(norm(capsule.from), norm(capsule.to)) + capsule.radius;
    return path + base.distance + base.angle * std::min(near + 0.5 * path, chain);
  }

  const KinematicTree& tree_;
  const std::vector<LinkExtent>& extents_;
  std::vector<double> middle_, poses_;
};

}  // namespace

void motion_bounds(const KinematicTree& tree, const std::vector<LinkExtent>& extents, const Motions& motions,
                   double* bounds_m) {
  if (extents.size() != tree.link_count()) {
    throw InvalidInput(std::to_string(extents.size()) + " extents for " + std::to_string(tree.link_count()) + " links");
  }
  const std::size_t columns = tree.configuration_size();
  require_finite(motions.from, motions.count, columns);
  require_finite(motions.to, motions.count, columns);
  std::vector<BaseMotion> bases;
  for (std::size_t i = 0; i < motions.base_count; ++i) {
    RigidTransform::from_matrix(motions.T_map_base_from + 16 * i);
    RigidTransform::from_matrix(motions.T_map_base_to + 16 * i);
    bases.emplace_back(motions.T_map_base_from + 16 * i, motions.T_map_base_to + 16 * i);
  }
  const std::size_t tasks = (motions.count + motions_per_task - 1) / motions_per_task;
  parallel_for(tasks, [&](std::size_t task, int) {
    Workspace workspace(tree, extents);
    const std::size_t end = std::min(motions.count, (task + 1) * motions_per_task);
    for (std::size_t i = task * motions_per_task; i < end; ++i) {
      workspace.bound(motions.from + i * columns, motions.to + i * columns, bases[motions.base_count == 1 ? 0 : i],
                      bounds_m + i * tree.link_count());
    }
  });
}

}  // namespace rayvox
