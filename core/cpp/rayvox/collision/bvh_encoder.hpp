#pragma once
#include <algorithm>
#include <vector>

#include "rayvox/collision/bvh_tree.hpp"
#include "rayvox/collision/oriented_box.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {

/// Computes the volumes of a tree's nodes and writes them as the kernels read them (bvh_view.hpp).
class BvhEncoder {
 public:
  BvhEncoder(KdopBvh& bvh, const BvhTree& tree) : bvh_(bvh), tree_(tree) {}
  void run();

 private:
  static constexpr int most_orientations = 2 * KdopAxes::most_axes;
  // Bounds what float32 rounding of vertices, axes and their products can take from a support value, relative to the
  // mesh's radius.
  static constexpr float support_margin = 0x1p-20f;
  static constexpr float absolute_margin_m = 1e-13f;
  static constexpr int most_slab = 32767;

  void allocate_slabs();
  bool has_rows() const;  // whether children's slabs lie side by side
  void find_supports();
  void find_supports_of_leaf(std::size_t node, const std::vector<float>& projections);
  void find_moments();
  void link_node(std::size_t node);
  template <class Visit>
  void for_each_corner(const BvhTree::Node& node, const Visit& visit) const;
  void centre_node(std::size_t node);
  void fit_box(std::size_t node);
  void write_leaf(std::size_t node);
  template <class Slab>
  void write_slabs(std::size_t node, AlignedVector<Slab>& own, AlignedVector<Slab>& child);
  void write_integer_slabs(std::size_t node);
  double relative_support(std::size_t of, int orientation, const BvhNode& frame) const;
  template <class Body>
  void for_each_node(std::size_t begin, std::size_t end, const Body& body) const;
  template <class Merge>
  void merge_upwards(const Merge& merge) const;

  KdopBvh& bvh_;
  const BvhTree& tree_;
  std::vector<float> supports_;  // most_orientations a node: axes, then their opposites; about the mesh's centre
  std::vector<SurfaceMoments> moments_;
};

template <class Body>
void BvhEncoder::for_each_node(std::size_t begin, std::size_t end, const Body& body) const {
  constexpr std::size_t chunk = 64;
  parallel_for((end - begin + chunk - 1) / chunk, [&](std::size_t c, int) {
    for (std::size_t i = begin + c * chunk; i < std::min(end, begin + (c + 1) * chunk); ++i) body(i);
  });
}

template <class Merge>
void BvhEncoder::merge_upwards(const Merge& merge) const {
  for (std::size_t level = tree_.level_begin.size() - 1; level-- > 0;) {
    for_each_node(tree_.level_begin[level], tree_.level_begin[level + 1], [&](std::size_t i) {
      const BvhTree::Node& node = tree_.nodes[i];
      for (std::uint32_t c = 0; c < node.child_count; ++c) merge(i, node.first_child + c);
    });
  }
}

template <class Visit>
void BvhEncoder::for_each_corner(const BvhTree::Node& node, const Visit& visit) const {
  const CollisionMesh& mesh = *bvh_.mesh_;
  for (std::uint32_t t = 0; t < node.triangle_count; ++t) {
    for (const std::uint32_t v : mesh.triangle_vertices(tree_.triangle_order[node.first_triangle + t])) {
      visit(mesh.vertex(v));
    }
  }
}

}  // namespace rayvox
