#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/collision/solid.hpp"
#include "rayvox/map_collision/interior_grid.hpp"
#include "rayvox/map_collision/placed_boxes.hpp"

namespace rayvox {

/// Some lanes of a block's boxes, or of a leaf's triangles.
struct BoxesOrTriangles {
  std::uint32_t index = 0, lanes = 0;
  bool triangles = false;
};

/// The closed parts of a mesh and where their inside is. Immutable.
struct LinkSolid {
  explicit LinkSolid(std::shared_ptr<const KdopBvh> of)
      : bvh(std::move(of)), solid(*bvh), interior(bvh->mesh(), solid) {}

  std::shared_ptr<const KdopBvh> bvh;
  Solid solid;
  InteriorGrid interior;
};

/// A rigid mesh's hierarchy as queries against maps traverse it: blocks of up to sixteen oriented boxes, relative to
/// the mesh's centre, from one box around everything (block 0) down to leaves of up to sixteen triangles. Immutable.
class LinkBody {
 public:
  struct Block {
    BoxBlock boxes;
    std::uint32_t child[16];              // lane: the block of an inner node's children, or a leaf
    std::uint16_t inner = 0, leaves = 0;  // lanes
    float largest_radius_m = 0;           // of its inner nodes
  };
  struct Leaf {
    TriangleBlock triangles;
    std::uint32_t first;  // position in the hierarchy's leaf order
    std::uint32_t count;
  };

  /// Throws InvalidInput unless the hierarchy is built for hybrid traversal, which has such boxes.
  explicit LinkBody(std::shared_ptr<const KdopBvh> bvh);
  /// The surface of a simplified mesh, with the inside of `detailed`, in whose frame it is.
  LinkBody(std::shared_ptr<const KdopBvh> surface, const LinkBody& detailed);

  const KdopBvh& bvh() const { return *bvh_; }
  const CollisionMesh& mesh() const { return bvh_->mesh(); }
  const Solid& solid() const { return solid_->solid; }
  const InteriorGrid& interior() const { return solid_->interior; }
  /// What the points asked of solid() and interior() are relative to.
  const Vec3d& solid_centre_m() const { return solid_->bvh->mesh().centre_m(); }
  const std::vector<Block>& blocks() const { return blocks_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  /// The lanes of a block whose boxes reach further than half_m along their longest axis.
  std::uint32_t boxes_larger_than(std::uint32_t block, float half_m) const {
    std::uint32_t larger = 0;
    for (unsigned lane = 0; lane < 16; ++lane) {
      larger |= static_cast<std::uint32_t>(blocks_[block].boxes.half[2][lane] > half_m) << lane;
    }
    return larger;
  }
  /// What a box of a block holds: the boxes of another block, or the triangles of a leaf.
  BoxesOrTriangles opened(std::uint32_t block, int lane) const {
    const std::uint32_t child = blocks_[block].child[lane];
    if (blocks_[block].leaves >> lane & 1) return {child, (1u << leaves_[child].count) - 1, true};
    return {child, static_cast<std::uint32_t>(blocks_[child].inner | blocks_[child].leaves), false};
  }

 private:
  LinkBody(std::shared_ptr<const KdopBvh> bvh, std::shared_ptr<const LinkSolid> solid);
  void add_child(Block& block, int lane, std::uint32_t node);
  std::uint32_t add_block(std::uint32_t node);
  std::uint32_t add_leaf(std::uint32_t node);

  std::shared_ptr<const KdopBvh> bvh_;
  std::shared_ptr<const LinkSolid> solid_;
  std::vector<Block> blocks_;
  std::vector<Leaf> leaves_;
};

}  // namespace rayvox
