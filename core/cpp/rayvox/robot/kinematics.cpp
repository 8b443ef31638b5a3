#include "rayvox/robot/kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "rayvox/error.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr double unit_tolerance = 1e-9;
constexpr std::size_t configurations_per_task = 64;

using Matrix3 = std::array<double, 9>;

Matrix3 product(const Matrix3& a, const Matrix3& b) {
  Matrix3 c{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  }
  return c;
}

void require_joint(const LinkJoint& joint, std::size_t link, std::size_t configuration_size) {
  const std::string which = "joint of link " + std::to_string(link);
  if (joint.parent < -1 || joint.parent >= static_cast<int>(link)) {
    throw InvalidInput(which + ": parent " + std::to_string(joint.parent) + " does not come before it");
  }
  RigidTransform::from_matrix(joint.T_parent_joint.data());
  if (joint.motion == JointMotion::fixed) return;
  if (joint.column < 0 || static_cast<std::size_t>(joint.column) >= configuration_size) {
    throw InvalidInput(which + ": column " + std::to_string(joint.column) + " of configurations of " +
                       std::to_string(configuration_size));
  }
  if (!(std::abs(norm(joint.axis) - 1) <= unit_tolerance)) throw InvalidInput(which + ": its axis is no unit vector");
  if (!std::isfinite(joint.multiplier) || !std::isfinite(joint.offset)) {
    throw InvalidInput(which + ": multiplier or offset is not finite");
  }
}

// out = parent * [r | t], all row-major with 4 columns; r has 3 of 3.
void compose(const double* parent, const double* r, double tx, double ty, double tz, double* out) {
  for (int i = 0; i < 3; ++i) {
    const double *p = parent + 4 * i, p0 = p[0], p1 = p[1], p2 = p[2];
    double* o = out + 4 * i;
    o[0] = p0 * r[0] + p1 * r[3] + p2 * r[6];
    o[1] = p0 * r[1] + p1 * r[4] + p2 * r[7];
    o[2] = p0 * r[2] + p1 * r[5] + p2 * r[8];
    o[3] = p0 * tx + p1 * ty + p2 * tz + p[3];
  }
  out[12] = out[13] = out[14] = 0;
  out[15] = 1;
}

}  // namespace

KinematicTree::KinematicTree(std::vector<LinkJoint> joints, std::size_t configuration_size)
    : joints_(std::move(joints)), configuration_size_(configuration_size) {
  rotors_.reserve(joints_.size());
  for (std::size_t link = 0; link < joints_.size(); ++link) {
    const LinkJoint& joint = joints_[link];
    require_joint(joint, link, configuration_size);
    const Matrix4d& T = joint.T_parent_joint;
    const Vec3d a = joint.axis;
    const Matrix3 base{T[0], T[1], T[2], T[4], T[5], T[6], T[8], T[9], T[10]};
    const Matrix3 cross{0, -a.z, a.y, a.z, 0, -a.x, -a.y, a.x, 0};
    rotors_.push_back({base, product(base, cross), product(base, product(cross, cross))});
  }
}

void KinematicTree::place_links(const double* configuration, const double* T_map_base, double* T_map_links) const {
  for (std::size_t link = 0; link < joints_.size(); ++link) {
    const LinkJoint& joint = joints_[link];
    const Rotor& rotor = rotors_[link];
    const double* parent = joint.parent < 0 ? T_map_base : T_map_links + 16 * joint.parent;
    double tx = joint.T_parent_joint[3], ty = joint.T_parent_joint[7], tz = joint.T_parent_joint[11];
    const double* rotation = rotor.base.data();
    Matrix3 turned;
    if (joint.motion == JointMotion::revolute) {
      const double q = joint.value(configuration), s = std::sin(q), half = std::sin(0.5 * q);
      const double v = 2 * half * half;  // 1 - cos(q) without its cancellation
      for (std::size_t i = 0; i < 9; ++i) turned[i] = rotor.base[i] + s * rotor.sine[i] + v * rotor.versine[i];
      rotation = turned.data();
    } else if (joint.motion == JointMotion::prismatic) {
      const Vec3d slide = joint.axis * joint.value(configuration);
      tx += rotor.base[0] * slide.x + rotor.base[1] * slide.y + rotor.base[2] * slide.z;
      ty += rotor.base[3] * slide.x + rotor.base[4] * slide.y + rotor.base[5] * slide.z;
      tz += rotor.base[6] * slide.x + rotor.base[7] * slide.y + rotor.base[8] * slide.z;
    }
    compose(parent, rotation, tx, ty, tz, T_map_links + 16 * link);
  }
}

void KinematicTree::link_poses(const double* configurations, std::size_t count, const double* T_map_base,
                               std::size_t base_count, double* T_map_links) const {
  if (base_count != 1 && base_count != count) {
    throw InvalidInput(std::to_string(base_count) + " base poses for " + std::to_string(count) + " configurations");
  }
  require_finite(configurations, count, configuration_size_);
  for (std::size_t i = 0; i < base_count; ++i) RigidTransform::from_matrix(T_map_base + 16 * i);
  const std::size_t tasks = (count + configurations_per_task - 1) / configurations_per_task;
  parallel_for(tasks, [&](std::size_t task, int) {
    const std::size_t end = std::min(count, (task + 1) * configurations_per_task);
    for (std::size_t i = task * configurations_per_task; i < end; ++i) {
      place_links(configurations + i * configuration_size_, T_map_base + (base_count == 1 ? 0 : 16 * i),
                  T_map_links + 16 * link_count() * i);
    }
  });
}

void require_finite(const double* configurations, std::size_t count, std::size_t columns) {
  for (std::size_t i = 0; i < count * columns; ++i) {
    if (!std::isfinite(configurations[i])) {
      throw InvalidInput("configurations[" + std::to_string(i / columns) + "][" + std::to_string(i % columns) +
                         "] is not finite: " + std::to_string(configurations[i]));
    }
  }
}

}  // namespace rayvox
