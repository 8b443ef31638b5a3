// The oriented boxes of a hierarchy for hybrid traversal.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rayvox/collision/bvh_encoder.hpp"

namespace rayvox {

void BvhEncoder::find_moments() {
  const CollisionMesh& mesh = *bvh_.mesh_;
  moments_.resize(tree_.nodes.size());
  const double least = 1e-12 * mesh.radius_m() * mesh.radius_m() + 1e-60;
  for_each_node(0, tree_.nodes.size(), [&](std::size_t i) {
    const BvhTree::Node& node = tree_.nodes[i];
    if (node.child_count > 0) return;
    for (std::uint32_t t = 0; t < node.triangle_count; ++t) {
      moments_[i].add(mesh.triangle(tree_.triangle_order[node.first_triangle + t]), least);
    }
  });
  merge_upwards([&](std::size_t parent, std::size_t child) { moments_[parent].add(moments_[child]); });
}

void BvhEncoder::fit_box(std::size_t i) {
  const CollisionMesh& mesh = *bvh_.mesh_;
  const BvhTree::Node& from = tree_.nodes[i];
  BvhNode& node = bvh_.nodes_[i];
  const std::array<Vec3d, 3> axes = principal_axes(moments_[i]);
  double low[3], high[3];
  std::fill_n(low, 3, std::numeric_limits<double>::infinity());
  std::fill_n(high, 3, -std::numeric_limits<double>::infinity());
  for_each_corner(from, [&](const Vec3d& p) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double at = axes[a].x * p.x + axes[a].y * p.y + axes[a].z * p.z;
      low[a] = std::min(low[a], at);
      high[a] = std::max(high[a], at);
    }
  });
  std::array<std::size_t, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return high[a] - low[a] < high[b] - low[b]; });
  Vec3d centre;
  for (std::size_t a = 0; a < 3; ++a) centre = centre + axes[a] * ((low[a] + high[a]) / 2);
  double radius = 0;
  const float margin = 4 * support_margin * static_cast<float>(mesh.radius_m()) + absolute_margin_m;
  for (std::size_t a = 0; a < 3; ++a) {
    const double half = (high[order[a]] - low[order[a]]) / 2;
    radius += half * half;
    node.box_half[a] = static_cast<float>(half) + margin;
    for (int c = 0; c < 3 && a < 2; ++c)
      node.box_axis[3 * a + static_cast<std::size_t>(c)] = static_cast<float>(axes[order[a]][c]);
  }
  for (int c = 0; c < 3; ++c) node.origin[c] = static_cast<float>(centre[c]);
  node.radius = static_cast<float>(std::sqrt(radius)) * (1 + 0x1p-20f) + margin;
}

}  // namespace rayvox
