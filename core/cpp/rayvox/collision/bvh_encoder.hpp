#pragma once
#include <vector>

#include "rayvox/collision/bvh_tree.hpp"
#include "rayvox/collision/oriented_box.hpp"

namespace rayvox {

/// Computes the volumes of a tree's nodes and writes them as the kernels read them (bvh_view.hpp).
class BvhEncoder {
 public:
  BvhEncoder(KdopBvh& bvh, const BvhTree& tree) : bvh_(bvh), tree_(tree) {}
  void run();

 private:
  static constexpr int most_orientations = 2 * KdopAxes::most_axes;

  void find_supports();
  void find_supports_of_leaf(std::size_t node, const std::vector<float>& projections);
  void find_moments();
  void place_node(std::size_t node);
  void fit_box(std::size_t node);
  void write_leaf(std::size_t node);
  void write_boxes(std::size_t node);
  template <class Slab>
  void write_slabs(std::size_t node, AlignedVector<Slab>& own, AlignedVector<Slab>& child);
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

}  // namespace rayvox
