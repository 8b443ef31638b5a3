#pragma once
// How far the links of a robot move between two configurations: the motion bound of continuous collision checking by
// conservative advancement (Schwarzer, Saha, Latombe: Adaptive dynamic collision checking for single and multiple
// articulated robots in complex environments, IEEE T-RO 2005, section V), with radii taken where the motion takes
// place instead of over all configurations.
#include <cstddef>
#include <vector>

#include "rayvox/robot/kinematics.hpp"

namespace rayvox {

/// A capsule around everything a link holds, link frame, metres; a link without geometry has a negative radius.
struct LinkExtent {
  Vec3d from, to;
  double radius_m = -1;

  bool empty() const { return radius_m < 0; }
};

/// A motion in which every joint and the base move at constant speed: joints and the base's position linearly, its
/// rotation about one axis (slerp). One of many, all in arrays of `count` rows.
struct Motions {
  const double* from;  ///< configurations, as KinematicTree takes them
  const double* to;
  const double* T_map_base_from;  ///< 4x4 each; base_count of them
  const double* T_map_base_to;
  std::size_t count;
  std::size_t base_count;  ///< 1 or count
};

/// Writes `count` x link_count() upper bounds, metres, of the length of the path of any point of each link. A point
/// moves at no more than this speed per unit of the motion's parameter, so between parameters s and t by at most
/// |t - s| times it. 0 for links without geometry. Throws InvalidInput as KinematicTree::link_poses, and where there
/// is not one extent per link.
void motion_bounds(const KinematicTree& tree, const std::vector<LinkExtent>& extents, const Motions& motions,
                   double* bounds_m);

}  // namespace rayvox
