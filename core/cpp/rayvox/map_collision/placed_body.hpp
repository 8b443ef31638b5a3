#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/map_collision/link_body.hpp"
#include "rayvox/map_collision/triangle_cube_distance.hpp"
#include "rayvox/octree/box.hpp"
#include "rayvox/simd/collision_kernels.hpp"

namespace rayvox {

/// A voxel at any level, grown by the padding: in float32 for the kernels, and as it is.
struct PlacedCube {
  LocalCube local;
  Vec3d centre;  // metres, relative to the translation of the body's pose
  double half;
};

/// One link body at one pose in a map after the other: turns boxes and triangles into the map's axes when they are
/// first asked for, and tests them against voxels. One thread's.
class PlacedBody {
 public:
  PlacedBody(const LinkBody& body, const MapGeometry& map, const CollisionKernels& kernels);
  PlacedBody(const PlacedBody&) = delete;
  PlacedBody(PlacedBody&&) = default;

  void place(const RigidTransform& T_map_link, double padding_m);

  const LinkBody& body() const { return body_; }
  const Vec3d& translation() const { return translation_; }
  /// The voxel of 2^level cells from `first` on.
  PlacedCube cube(const Cell& first, int level) const;
  /// All cells that the padded body may touch, clipped to the octree; whether it may touch what lies beyond.
  CellBox cells_in_reach(bool& may_reach_beyond);
  /// The lanes of a block whose boxes may meet the cube.
  std::uint32_t lanes_meeting(std::uint32_t block, const LocalCube& cube);
  /// Which of some cells of an octant (Morton order) the box of one lane of a block may meet.
  std::uint64_t cells_meeting(std::uint32_t block, int lane, const LocalCells& octant, std::uint64_t cells);
  /// The finest cells of the octant from `first` on.
  LocalCells cells(const Cell& first) const;
  /// The triangles of a leaf that may meet the cube; whether one of those does.
  std::uint32_t triangles_near(std::uint32_t leaf, const LocalCube& cube);
  bool triangles_meet(std::uint32_t leaf, std::uint32_t near, const PlacedCube& cube) const;

  /// Lower bounds of squared distances below `limit`, of a block's boxes or a leaf's triangles from the cube, or from
  /// its octants. Times scale_of_squares() they bound the true distances, for all that float32 and the pose take.
  NearLanes near_cube(BoxesOrTriangles of, const PlacedCube& cube, float limit);
  void near_octants(BoxesOrTriangles of, const PlacedCube& cube, unsigned octants, float limit, NearLanes* near);
  float scale_of_squares() const { return scale_of_squares_; }
  /// Lowers `nearest` to the distance of one of a leaf's triangles from the cube, whose points are then relative to the
  /// cube's centre; true if it did.
  bool lower_to_triangle(std::uint32_t leaf, std::uint32_t lane, const PlacedCube& cube, Separation& nearest) const;
  /// A box in the map, metres, that holds the padded body.
  std::pair<Vec3d, Vec3d> bounds();
  /// The padded surface's distance from what lies beyond the octree, where it is less than `within`; points as above,
  /// relative to the translation of the pose.
  Separation distance_to_border(double within) const;
  /// Whether a point of the padded surface lies on the border of the octree or beyond.
  bool reaches_beyond_map() const;
  /// Whether a closed part may enclose a cube inside this one that no triangle meets and that has at least half the
  /// edge of a finest cell.
  bool may_enclose_any(const PlacedCube& cube);
  /// Whether the centre of a cube that no triangle meets, and so all of it, is inside a closed part.
  bool encloses(const PlacedCube& cube);

 private:
  struct Slot {
    std::uint32_t pose = 0, at = 0;
  };
  template <class T>
  static bool fetch(std::vector<Slot>& slots, std::vector<T>& pool, std::size_t& used, std::uint32_t pose,
                    std::uint32_t index, T*& out);
  PlacedBoxes& placed_block(std::uint32_t block);
  Vec3d turned(const Vec3d& p) const;
  TriangleBlock& placed_leaf(std::uint32_t leaf);
  Triangle placed_triangle(std::uint32_t position, const Vec3d& origin, double& size) const;
  // A point relative to the pose's translation, in the frame of the body's solid.
  Vec3d in_solid(const Vec3d& p);

  const LinkBody& body_;
  const MapGeometry& map_;
  const CollisionKernels& kernels_;
  double radius_m_, cells_per_m_, padding_m_ = 0;
  double rotation_[9], inverse_[9];
  bool inverted_ = false;  // inverse_ and solid_centre_ are this pose's
  Vec3d solid_centre_;
  float rotation_f32_[9], margin_m_ = 0, scale_of_squares_ = 1;
  Vec3d translation_, centre_;     // of the pose; of the mesh, relative to it
  Vec3d near_cell_, near_cell_m_;  // a finest cell near the pose; its low corner, relative to the translation
  std::uint32_t pose_ = 0;
  std::vector<Slot> block_slots_, leaf_slots_;
  std::vector<PlacedBoxes> blocks_;
  std::vector<TriangleBlock> leaves_;
  std::size_t blocks_used_ = 0, leaves_used_ = 0;
};

}  // namespace rayvox
