#pragma once
// Forward kinematics of a tree of links, float64.
#include <array>
#include <cstddef>
#include <vector>

#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// Row-major 4x4 rigid transform, the layout of the numpy arrays that poses are written to.
using Matrix4d = std::array<double, 16>;

enum class JointMotion { fixed, revolute, prismatic };

/// What places a link on its parent: T_parent_link = T_parent_joint * motion(multiplier * q[column] + offset), turning
/// about or sliding along `axis`, a unit vector in the joint's frame. Several joints may follow one column (mimic).
struct LinkJoint {
  int parent = -1;  ///< Index of the parent link; -1 for the base.
  JointMotion motion = JointMotion::fixed;
  Matrix4d T_parent_joint{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  Vec3d axis{1, 0, 0};
  int column = 0;
  double multiplier = 1;
  double offset = 0;

  double value(const double* configuration) const { return multiplier * configuration[column] + offset; }
};

/// Links in an order in which parents come before their children.
class KinematicTree {
 public:
  /// One joint per link, and the number of columns of a configuration. Throws InvalidInput for a parent or column that
  /// is out of range, an axis that is not of unit length, or a T_parent_joint that is not rigid.
  KinematicTree(std::vector<LinkJoint> joints, std::size_t configuration_size);

  std::size_t link_count() const { return joints_.size(); }
  std::size_t configuration_size() const { return configuration_size_; }
  const std::vector<LinkJoint>& joints() const { return joints_; }

  /// T_map_link of every link, link_count() matrices, at one configuration.
  void place_links(const double* configuration, const double* T_map_base, double* T_map_links) const;

  /// The same for `count` configurations (row-major, configuration_size() columns), in parallel. `T_map_base` holds one
  /// matrix for all or one for each. Throws InvalidInput naming the first configuration that is not finite or base
  /// that is not rigid; the output is then undefined.
  void link_poses(const double* configurations, std::size_t count, const double* T_map_base, std::size_t base_count,
                  double* T_map_links) const;

 private:
  // Rodrigues: rotation(q) = identity + sin(q) * cross + (1 - cos(q)) * cross^2, all three times T_parent_joint's own
  // rotation beforehand, so that a joint costs one sine, one cosine and 18 multiplications more than a fixed one.
  struct Rotor {
    std::array<double, 9> base, sine, versine;
  };

  std::vector<LinkJoint> joints_;
  std::vector<Rotor> rotors_;
  std::size_t configuration_size_;
};

/// Throws InvalidInput naming the first of `count` configurations with a value that is not finite.
void require_finite(const double* configurations, std::size_t count, std::size_t columns);

}  // namespace rayvox
