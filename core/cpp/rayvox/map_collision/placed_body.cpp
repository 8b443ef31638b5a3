#include "rayvox/map_collision/placed_body.hpp"

#include <algorithm>
#include <cmath>

#include "rayvox/geometry/rotation.hpp"
#include "rayvox/map_collision/triangle_cube.hpp"

namespace rayvox {
namespace {

// More than float32 takes from any bound, relative to the sizes that enter it.
constexpr double margin_of_size = 0x1p-18;
constexpr double least_margin_m = 1e-12;
// More than float64 takes from the placement of a corner or a voxel, relative to their distances from the pose's
// origin.
constexpr double rounding_of_placement = 0x1p-50;

Vec3d product(const double* r, const Vec3d& p) {
  return {r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
          r[6] * p.x + r[7] * p.y + r[8] * p.z};
}

}  // namespace

PlacedBody::PlacedBody(const LinkBody& body, const MapGeometry& map, const CollisionKernels& kernels)
    : body_(body),
      map_(map),
      kernels_(kernels),
      radius_m_(body.mesh().radius_m()),
      cells_per_m_(1 / map.resolution_m()),
      block_slots_(body.blocks().size()),
      leaf_slots_(body.leaves().size()) {}

void PlacedBody::place(const RigidTransform& T_map_link, double padding_m) {
  padding_m_ = padding_m;
  std::copy_n(T_map_link.rotation(), 9, rotation_);
  for (int i = 0; i < 9; ++i) rotation_f32_[i] = static_cast<float>(rotation_[i]);
  inverted_ = false;
  translation_ = T_map_link.translation();
  centre_ = turned(body_.mesh().centre_m());
  // Voxels are placed by their steps from one near the pose, which is placed with one rounding: a map far from its
  // origin is as exact as one at it.
  for (int c = 0; c < 3; ++c) {
    const double most = 2.0 * map_.half_extent();
    near_cell_[c] =
        static_cast<double>(static_cast<std::int64_t>(std::clamp(translation_[c] * cells_per_m_, -most, most)));
    near_cell_m_[c] = std::fma(near_cell_[c], map_.resolution_m(), -translation_[c]);
  }
  const double deviation = deviation_from_rotation(rotation_);
  margin_m_ = static_cast<float>((margin_of_size + 4 * deviation) * radius_m_ + least_margin_m +
                                 rounding_of_placement * norm(centre_));
  scale_of_squares_ = static_cast<float>(1 - 8 * (margin_of_size + 4 * deviation));
  ++pose_;
  blocks_used_ = leaves_used_ = 0;
}

Vec3d PlacedBody::turned(const Vec3d& p) const { return product(rotation_, p); }

PlacedCube PlacedBody::cube(const Cell& first, int level) const {
  const double half_cells = 0.5 * static_cast<double>(std::int64_t{1} << level), r = map_.resolution_m();
  PlacedCube cube;
  cube.half = half_cells * r + padding_m_;
  for (int c = 0; c < 3; ++c) {
    const double cells = first[static_cast<std::size_t>(c)] - near_cell_[c] + half_cells;
    cube.centre[c] = near_cell_m_[c] + cells * r;
    cube.local.centre[c] = static_cast<float>(cube.centre[c] - centre_[c]);
  }
  cube.local.half = static_cast<float>(cube.half * (1 + margin_of_size)) + margin_m_;
  return cube;
}

template <class T>
bool PlacedBody::fetch(std::vector<Slot>& slots, std::vector<T>& pool, std::size_t& used, std::uint32_t pose,
                       std::uint32_t index, T*& out) {
  Slot& slot = slots[index];
  const bool placed = slot.pose == pose;
  if (!placed) {
    if (used == pool.size()) pool.resize(std::max<std::size_t>(16, 2 * used));
    slot = {pose, static_cast<std::uint32_t>(used++)};
  }
  out = &pool[slot.at];
  return placed;
}

PlacedBoxes& PlacedBody::placed_block(std::uint32_t block) {
  PlacedBoxes* boxes;
  if (!fetch(block_slots_, blocks_, blocks_used_, pose_, block, boxes)) {
    kernels_.place_boxes(body_.blocks()[block].boxes, rotation_f32_, margin_m_, *boxes);
  }
  return *boxes;
}

TriangleBlock& PlacedBody::placed_leaf(std::uint32_t leaf) {
  TriangleBlock* triangles;
  if (!fetch(leaf_slots_, leaves_, leaves_used_, pose_, leaf, triangles)) {
    kernels_.place_triangles(body_.leaves()[leaf].triangles, rotation_f32_, *triangles);
  }
  return *triangles;
}

// The triangle at a position of the leaf order, relative to `origin`; raises `size` to the lengths that were rounded.
Triangle PlacedBody::placed_triangle(std::uint32_t position, const Vec3d& origin, double& size) const {
  Triangle placed = body_.mesh().triangle(body_.bvh().triangle_at(position));
  size = std::max(size, norm(origin));
  for (Vec3d& corner : placed) {
    corner = corner + body_.mesh().centre_m();
    size = std::max(size, norm(corner));
    corner = turned(corner) - origin;
  }
  return placed;
}

std::uint32_t PlacedBody::lanes_meeting(std::uint32_t block, const LocalCube& cube) {
  const LinkBody::Block& lanes = body_.blocks()[block];
  return kernels_.boxes_meeting_cube(placed_block(block), cube) &
         static_cast<std::uint32_t>(lanes.inner | lanes.leaves);
}

LocalCells PlacedBody::cells(const Cell& first) const {
  const LocalCube cube = this->cube(first, 0).local;
  const auto edge = static_cast<float>(map_.resolution_m());
  return {{cube.centre[0], cube.centre[1], cube.centre[2]}, edge, cube.half, 1 / edge};
}

std::uint64_t PlacedBody::cells_meeting(std::uint32_t block, int lane, const LocalCells& octant, std::uint64_t cells) {
  return kernels_.cells_meeting_box(placed_block(block), lane, octant, cells);
}

std::uint32_t PlacedBody::triangles_near(std::uint32_t index, const LocalCube& cube) {
  const LinkBody::Leaf& leaf = body_.leaves()[index];
  return kernels_.triangles_meeting_cube(placed_leaf(index), cube) & ((1u << leaf.count) - 1);
}

bool PlacedBody::triangles_meet(std::uint32_t leaf, std::uint32_t near, const PlacedCube& cube) const {
  for (; near; near &= near - 1) {
    double size = 0;
    const Triangle placed = placed_triangle(
        body_.leaves()[leaf].first + static_cast<std::uint32_t>(__builtin_ctz(near)), cube.centre, size);
    if (triangle_meets_cube(placed, cube.half + rounding_of_placement * size)) return true;
  }
  return false;
}

NearLanes PlacedBody::near_cube(BoxesOrTriangles of, const PlacedCube& cube, float limit) {
  if (of.triangles) return kernels_.triangles_near_cube(placed_leaf(of.index), cube.local, of.lanes, limit);
  return kernels_.boxes_near_cube(placed_block(of.index), cube.local, of.lanes, limit);
}

void PlacedBody::near_octants(BoxesOrTriangles of, const PlacedCube& cube, unsigned octants, float limit,
                              NearLanes* near) {
  const double quarter = 0.5 * (cube.half - padding_m_);
  LocalOctants cubes;
  std::copy_n(cube.local.centre, 3, cubes.centre);
  cubes.quarter = static_cast<float>(quarter);
  cubes.half = static_cast<float>((quarter + padding_m_) * (1 + 4 * margin_of_size)) + margin_m_;
  if (of.triangles) {
    kernels_.triangles_near_octants(placed_leaf(of.index), cubes, octants, of.lanes, limit, near);
  } else {
    kernels_.boxes_near_octants(placed_block(of.index), cubes, octants, of.lanes, limit, near);
  }
}

bool PlacedBody::lower_to_triangle(std::uint32_t leaf, std::uint32_t lane, const PlacedCube& cube,
                                   Separation& nearest) const {
  double size = 0;
  const Triangle placed = placed_triangle(body_.leaves()[leaf].first + lane, cube.centre, size);
  Separation found = distance_to_cube(placed, cube.half);
  found.distance = std::max(found.distance - rounding_of_placement * size, 0.0);
  if (found.distance >= nearest.distance) return false;
  nearest = found;
  return true;
}

std::pair<Vec3d, Vec3d> PlacedBody::bounds() {
  const PlacedBoxes& root = placed_block(0);
  Vec3d low, high;
  for (int c = 0; c < 3; ++c) {
    const double middle = translation_[c] + centre_[c] + static_cast<double>(root.centre[c][0]);
    const double extent =
        static_cast<double>(root.extent[c][0]) * (1 + margin_of_size) + padding_m_ + 1e-14 * std::abs(middle);
    low[c] = middle - extent;
    high[c] = middle + extent;
  }
  return {low, high};
}

CellBox PlacedBody::cells_in_reach(bool& may_reach_beyond) {
  const PlacedBoxes& root = placed_block(0);
  const double half_extent = map_.half_extent(), r = map_.resolution_m();
  CellBox box{};
  may_reach_beyond = false;
  for (int c = 0; c < 3; ++c) {
    const double middle = translation_[c] + centre_[c] + static_cast<double>(root.centre[c][0]);
    // Voxels that are only touched count, and what lies a rounding error away may be touched.
    const double extent = static_cast<double>(root.extent[c][0]) * (1 + margin_of_size) + padding_m_ +
                          1e-14 * std::abs(middle) + 1e-9 * r;
    const double low = (middle - extent) / r, high = (middle + extent) / r;
    may_reach_beyond |= low <= -half_extent || high >= half_extent;
    const auto i = static_cast<std::size_t>(c);
    box.low[i] = static_cast<std::int32_t>(std::floor(std::clamp(low, -half_extent, half_extent)));
    box.high[i] = static_cast<std::int32_t>(std::floor(std::clamp(high, -half_extent - 1, half_extent - 1)));
  }
  return box;
}

bool PlacedBody::reaches_beyond_map() const {
  const Vec3d& mesh_centre = body_.mesh().centre_m();
  const double h = map_.half_extent(), r = map_.resolution_m();
  for (std::size_t t = 0; t < body_.mesh().triangle_count(); ++t) {
    for (const Vec3d& corner : body_.mesh().triangle(t)) {
      const Vec3d p = turned(corner + mesh_centre);
      for (int c = 0; c < 3; ++c) {
        if (p[c] - padding_m_ <= std::fma(-h, r, -translation_[c])) return true;
        if (p[c] + padding_m_ >= std::fma(h, r, -translation_[c])) return true;
      }
    }
  }
  return false;
}

Separation PlacedBody::distance_to_border(double within) const {
  const double h = map_.half_extent(), r = map_.resolution_m();
  Separation nearest{within, {}, {}};
  for (std::size_t t = 0; t < body_.mesh().triangle_count(); ++t) {
    for (const Vec3d& corner : body_.mesh().triangle(t)) {
      const Vec3d at = corner + body_.mesh().centre_m(), p = turned(at);
      for (int c = 0; c < 3; ++c) {
        for (const double side : {-h, h}) {
          const double border = std::fma(side, r, -translation_[c]);
          const double distance = (side > 0 ? border - p[c] : p[c] - border) - padding_m_;
          const double least = distance - rounding_of_placement * (norm(at) + std::abs(border));
          if (least >= nearest.distance) continue;
          nearest = {std::max(least, 0.0), p, p};
          nearest.on_cube[c] = border;
        }
      }
    }
  }
  return nearest;
}

Vec3d PlacedBody::in_solid(const Vec3d& p) {
  if (!inverted_) {
    invert_rotation(rotation_, inverse_);
    solid_centre_ = turned(body_.solid_centre_m());
    inverted_ = true;
  }
  return product(inverse_, p - solid_centre_);
}

bool PlacedBody::may_enclose_any(const PlacedCube& cube) {
  // No corner of the cube is further away along any axis than a corner along its diagonal.
  constexpr double diagonal = 1.7320509;
  return body_.interior().may_hold_inside(in_solid(cube.centre), cube.half * diagonal, 0.5 * map_.resolution_m());
}

bool PlacedBody::encloses(const PlacedCube& cube) {
  const Vec3d p = in_solid(cube.centre);
  switch (body_.interior().side(p, cube.half)) {
    case InteriorGrid::Side::inside: return true;
    case InteriorGrid::Side::outside: return false;
    default: return body_.solid().contains(p);
  }
}

}  // namespace rayvox
