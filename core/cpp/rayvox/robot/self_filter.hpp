#pragma once
// Points that a sensor saw on the robot that carries it.
#include <cstdint>
#include <vector>

#include "rayvox/geometry/points_view.hpp"
#include "rayvox/geometry/triangle_tree.hpp"
#include "rayvox/robot/kinematics.hpp"
#include "rayvox/robot/motion_bound.hpp"

namespace rayvox {

/// The body of one link as the filter sees it: `mesh` (null for a link without geometry) grown by `padding_m`, and the
/// capsule around the mesh without padding.
struct FilterLink {
  const TriangleTree* mesh = nullptr;
  LinkExtent extent;
  double padding_m = 0;
};

enum ScanPoint : std::uint8_t { kept = 0, on_body = 1, behind_body = 2 };

/// Writes one ScanPoint per point: on_body within the padding of a link's surface or inside a closed part of it,
/// behind_body where the ray from `origin_m` comes within the padding of a link's surface on its way.
///
/// A link whose padded body holds the origin, as the one that carries the sensor often does, stops no rays: it still
/// takes points. Points and origin are in the same frame as the poses `T_frame_links` (row-major 4x4, one per link).
void filter_body(const std::vector<FilterLink>& links, const double* T_frame_links, const PointsView& points,
                 const Vec3d& origin_m, std::uint8_t* out);

}  // namespace rayvox
