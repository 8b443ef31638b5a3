#include "rayvox/collision/bvh_tree.hpp"

#include <algorithm>
#include <numeric>
#include <span>

#include "rayvox/collision/partition.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

// Clusters vary in size; aiming a little below a full leaf keeps most of them from being split once more.
constexpr double leaf_fill = 0.7;
// A part that keeps nearly all triangles makes no progress worth a level.
constexpr double largest_part = 15.0 / 16;

class TreeBuilder {
 public:
  TreeBuilder(const CollisionMesh& mesh, const BvhOptions& options) : options_(options) {
    items_.resize(mesh.triangle_count());
    parallel_chunks(items_.size(), [&](std::size_t i) {
      const Triangle t = mesh.triangle(i);
      const Vec3d middle = (t[0] + t[1] + t[2]) * (1.0 / 3);
      items_[i] = {{static_cast<float>(middle.x), static_cast<float>(middle.y), static_cast<float>(middle.z)},
                   static_cast<std::uint32_t>(i)};
    });
    if (options.construction == Construction::surface_area_heuristic) find_bounds(mesh);
  }

  BvhTree build() {
    BvhTree tree;
    tree.nodes.push_back({0, static_cast<std::uint32_t>(items_.size())});
    tree.level_begin = {0};
    for (std::size_t begin = 0; begin < tree.nodes.size();) {
      const std::size_t end = tree.nodes.size();
      tree.level_begin.push_back(static_cast<std::uint32_t>(end));
      split_level(tree, begin, end);
      begin = end;
    }
    tree.triangle_order.resize(items_.size());
    for (std::size_t i = 0; i < items_.size(); ++i) tree.triangle_order[i] = items_[i].triangle;
    return tree;
  }

 private:
  template <class Body>
  static void parallel_chunks(std::size_t count, const Body& body) {
    constexpr std::size_t chunk = 4096;
    parallel_for((count + chunk - 1) / chunk, [&](std::size_t c, int) {
      for (std::size_t i = c * chunk; i < std::min(count, (c + 1) * chunk); ++i) body(i);
    });
  }

  void find_bounds(const CollisionMesh& mesh) {
    bounds_.resize(mesh.triangle_count());
    parallel_chunks(bounds_.size(), [&](std::size_t i) {
      const Triangle t = mesh.triangle(i);
      for (int axis = 0; axis < 3; ++axis) {
        bounds_[i].low[axis] = static_cast<float>(std::min({t[0][axis], t[1][axis], t[2][axis]}));
        bounds_[i].high[axis] = static_cast<float>(std::max({t[0][axis], t[1][axis], t[2][axis]}));
      }
    });
  }

  void split_level(BvhTree& tree, std::size_t begin, std::size_t end) {
    std::vector<std::vector<std::size_t>> sizes(end - begin);
    // Few large nodes are tasks of their own, many small ones go in bundles.
    const std::size_t chunk = std::clamp<std::size_t>((end - begin) / 64, 1, 256);
    parallel_for((end - begin + chunk - 1) / chunk, [&](std::size_t c, int) {
      for (std::size_t i = begin + c * chunk; i < std::min(end, begin + (c + 1) * chunk); ++i) {
        sizes[i - begin] = split(tree.nodes[i]);
      }
    });
    for (std::size_t i = begin; i < end; ++i) {
      if (sizes[i - begin].size() < 2) continue;
      tree.nodes[i].first_child = static_cast<std::uint32_t>(tree.nodes.size());
      tree.nodes[i].child_count = static_cast<std::uint32_t>(sizes[i - begin].size());
      std::uint32_t first = tree.nodes[i].first_triangle;
      for (const std::size_t size : sizes[i - begin]) {
        tree.nodes.push_back({first, static_cast<std::uint32_t>(size)});
        first += static_cast<std::uint32_t>(size);
      }
    }
  }

  int parts_of(std::size_t count) const {
    const double leaves = static_cast<double>(count) / std::max(1.0, leaf_fill * options_.leaf_size);
    return static_cast<int>(std::clamp(leaves + 0.999, 2.0, static_cast<double>(options_.branching_factor)));
  }

  std::vector<std::size_t> split(const BvhTree::Node& node) {
    const std::size_t count = node.triangle_count;
    if (count <= static_cast<std::size_t>(options_.leaf_size)) return {};
    const std::span<PartitionItem> items(items_.data() + node.first_triangle, count);
    const int parts = parts_of(count);
    if (static_cast<std::size_t>(parts) >= count) return split_evenly(count, parts);
    std::vector<std::size_t> sizes = split_by_criterion(items, parts, node.first_triangle);
    const std::size_t largest = *std::max_element(sizes.begin(), sizes.end());
    if (static_cast<double>(largest) <= largest_part * static_cast<double>(count)) return sizes;
    return split_extended_longest_axis(items, parts);
  }

  std::vector<std::size_t> split_by_criterion(std::span<PartitionItem> items, int parts, std::uint32_t first) {
    switch (options_.construction) {
      case Construction::longest_axis: return split_longest_axis(items, parts);
      case Construction::extended_longest_axis: return split_extended_longest_axis(items, parts);
      case Construction::surface_area_heuristic: return split_surface_area(items, bounds_);
      case Construction::batch_neural_gas: break;
    }
    return split_batch_neural_gas(items, parts, options_.seed * 0x9e3779b97f4a7c15u + first);
  }

  const BvhOptions& options_;
  std::vector<PartitionItem> items_;
  std::vector<TriangleBounds> bounds_;
};

}  // namespace

BvhTree build_tree(const CollisionMesh& mesh, const BvhOptions& options) { return TreeBuilder(mesh, options).build(); }

}  // namespace rayvox
