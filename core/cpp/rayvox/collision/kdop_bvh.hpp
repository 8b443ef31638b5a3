#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "rayvox/collision/bvh_view.hpp"
#include "rayvox/collision/collision_mesh.hpp"
#include "rayvox/collision/kdop_axes.hpp"

namespace rayvox {

/// How a node's triangles are split among its children (SIMDop, Sec. IV-A).
enum class Construction { longest_axis, extended_longest_axis, batch_neural_gas, surface_area_heuristic };

/// How two hierarchies are traversed (SIMDop, Sec. IV-B): the pair of nodes tested one orientation at a time, or
/// sixteen orientations at a time; one node against up to sixteen children; four children against four; or one oriented
/// box against up to sixteen.
enum class Traversal { scalar, simd_orientations, one_vs_sixteen, four_vs_four, hybrid };

/// Of the traversals other than hybrid, whose hierarchies keep 16-bit integers (bvh_view.hpp).
enum class SlabFormat { float32, float16 };

struct BvhOptions {
  KdopAxes axes = KdopAxes::standard(32);
  int branching_factor = 16;
  Construction construction = Construction::batch_neural_gas;
  SlabFormat slabs = SlabFormat::float16;
  Traversal traversal = Traversal::hybrid;
  int leaf_size = 16;  // most triangles of a leaf, 1 to 16
  std::uint64_t seed = 1;
};

/// Aligned to cache lines.
template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}
  T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), std::align_val_t{64})); }
  void deallocate(T* p, std::size_t) { ::operator delete(p, std::align_val_t{64}); }
  bool operator==(const AlignedAllocator&) const { return true; }
};
template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

/// The axis of a node's oriented box, of three, thinnest first.
Vec3d box_axis(const BvhNode& node, int index);

/// A wrapped hierarchy of k-DOPs over a mesh's triangles: every node's slabs enclose exactly its triangles', rounded
/// outward, not its children's volumes (SIMDop, Sec. IV-A). Immutable.
class KdopBvh {
 public:
  /// Throws InvalidInput for a branching factor other than 2, 4, 8 or 16, a leaf size outside 1 to 16, four_vs_four
  /// with a branching factor other than 4, or the surface area heuristic with one other than 2.
  KdopBvh(std::shared_ptr<const CollisionMesh> mesh, const BvhOptions& options);

  const CollisionMesh& mesh() const { return *mesh_; }
  const std::shared_ptr<const CollisionMesh>& shared_mesh() const { return mesh_; }
  const BvhOptions& options() const { return options_; }
  /// nodes()[0] is the root.
  const AlignedVector<BvhNode>& nodes() const { return nodes_; }
  /// The mesh's triangle at a position of the leaf order.
  std::uint32_t triangle_at(std::size_t position) const { return triangle_order_[position]; }
  const std::vector<std::uint32_t>& triangle_order() const { return triangle_order_; }
  /// Levels below the root.
  int depth() const { return depth_; }
  std::size_t nbytes() const;
  BvhView view() const;
  /// A node's support values, k of them (orientations of axes()), metres relative to the mesh's centre.
  std::vector<double> supports(std::size_t node) const;
  /// One of them.
  double support(std::size_t node, int orientation) const;
  /// The same of a child as its parent's rows have it, in a hierarchy with such rows.
  std::vector<double> block_supports(std::size_t parent, int lane) const;

 private:
  friend class BvhEncoder;

  std::shared_ptr<const CollisionMesh> mesh_;
  BvhOptions options_;
  AlignedVector<BvhNode> nodes_;
  AlignedVector<float> own_f32_, child_f32_;
  AlignedVector<std::uint16_t> own_f16_, child_f16_;
  AlignedVector<std::int16_t> own_i16_;
  float slab_unit_m_ = 0;  // of own_i16_
  AlignedVector<float> leaf_vertices_;
  std::vector<std::uint32_t> triangle_order_;
  int depth_ = 0;
};

}  // namespace rayvox
