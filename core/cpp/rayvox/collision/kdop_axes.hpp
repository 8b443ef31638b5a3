#pragma once
// The directions of k-DOPs (SIMDop, Sec. II): k/2 axes, each bounding by a slab; an orientation is an axis with a sign.
#include <array>
#include <cstdint>
#include <vector>

#include "rayvox/geometry/vec3.hpp"

namespace rayvox {

/// Three orientations and the plane through their end points. Every direction lies in the cone of exactly one cell of
/// the sphere (up to borders): there it is a combination of the three with coefficients that are not negative.
struct AxisCone {
  Vec3d plane;                // plane . orientation = 1 for its three
  std::array<int, 3> corner;  // orientation: axis, + axis_count if reversed
  std::array<Vec3d, 3> dual;  // coefficient of corner i of direction d: dual[i] . d
};

class KdopAxes {
 public:
  static constexpr int most_axes = 16;

  /// The standard set of k = 6, 8, 14, 16, 18, 24, 26 or 32 orientations; throws InvalidInput for another k.
  static KdopAxes standard(int k);
  /// 3 to 16 given axes, normalised here. Throws InvalidInput unless they are finite, not zero, pairwise not parallel,
  /// and span space.
  explicit KdopAxes(std::vector<Vec3d> axes);

  int count() const { return static_cast<int>(axes_.size()); }
  int k() const { return 2 * count(); }
  const Vec3d& operator[](int axis) const { return axes_[static_cast<std::size_t>(axis)]; }
  /// An orientation's direction: axis, or the opposite of axis - count().
  Vec3d orientation(int index) const { return index < count() ? (*this)[index] : (*this)[index - count()] * -1.0; }
  const std::vector<AxisCone>& cones() const { return cones_; }

  bool operator==(const KdopAxes& other) const;

 private:
  std::vector<Vec3d> axes_;
  std::vector<AxisCone> cones_;
};

}  // namespace rayvox
