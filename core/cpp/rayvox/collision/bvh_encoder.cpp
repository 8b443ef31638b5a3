#include "rayvox/collision/bvh_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rayvox/collision/half_float.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double dot(const Vec3d& a, const float* b) { return a.x * b[0] + a.y * b[1] + a.z * b[2]; }

float slab_not_below(double value, float) {
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}
std::uint16_t slab_not_below(double value, std::uint16_t) { return half_not_below(slab_not_below(value, 0.0f)); }

// Vectors of rows of fewer than sixteen values reach beyond the last row.
constexpr std::size_t reach = 32;

}  // namespace

void BvhEncoder::run() {
  const std::size_t count = tree_.nodes.size();
  bvh_.nodes_.resize(count);
  bvh_.leaf_vertices_.resize(9 * tree_.triangle_order.size() + reach);
  const bool hybrid = bvh_.options_.traversal == Traversal::hybrid;
  find_supports();
  if (hybrid) find_moments();
  for_each_node(0, count, [&](std::size_t i) {
    link_node(i);
    hybrid ? fit_box(i) : centre_node(i);
  });
  allocate_slabs();
  for_each_node(0, count, [&](std::size_t i) {
    if (hybrid)
      write_integer_slabs(i);
    else if (!bvh_.own_f16_.empty())
      write_slabs(i, bvh_.own_f16_, bvh_.child_f16_);
    else
      write_slabs(i, bvh_.own_f32_, bvh_.child_f32_);
    if (bvh_.nodes_[i].is_leaf) write_leaf(i);
  });
}

void BvhEncoder::allocate_slabs() {
  const BvhView view = bvh_.view();
  const std::size_t own = tree_.nodes.size() * static_cast<std::size_t>(view.stride);
  const std::size_t child = has_rows() ? tree_.nodes.size() * static_cast<std::size_t>(2 * view.axis_count) + reach : 0;
  if (bvh_.options_.traversal == Traversal::hybrid) {
    bvh_.own_i16_.resize(own);
    const double most_m = bvh_.mesh_->radius_m() * (1 + 4 * static_cast<double>(support_margin));
    bvh_.slab_unit_m_ = static_cast<float>((most_m + 4 * static_cast<double>(absolute_margin_m)) / most_slab);
  } else if (bvh_.options_.slabs == SlabFormat::float16) {
    bvh_.own_f16_.resize(own);
    bvh_.child_f16_.resize(child);
  } else {
    bvh_.own_f32_.resize(own);
    bvh_.child_f32_.resize(child);
  }
}

bool BvhEncoder::has_rows() const {
  const Traversal traversal = bvh_.options_.traversal;
  return traversal == Traversal::one_vs_sixteen || traversal == Traversal::four_vs_four;
}

void BvhEncoder::find_supports() {
  const CollisionMesh& mesh = *bvh_.mesh_;
  const KdopAxes& axes = bvh_.options_.axes;
  const int n = axes.count();
  std::vector<float> axis[3];
  for (auto& coordinate : axis) coordinate.resize(KdopAxes::most_axes);
  for (int a = 0; a < n; ++a) {
    for (int c = 0; c < 3; ++c) axis[c][static_cast<std::size_t>(a)] = static_cast<float>(axes[a][c]);
  }
  std::vector<float> projections(mesh.vertex_count() * KdopAxes::most_axes);
  for_each_node(0, mesh.vertex_count(), [&](std::size_t v) {
    const auto x = static_cast<float>(mesh.vertex(v).x), y = static_cast<float>(mesh.vertex(v).y),
               z = static_cast<float>(mesh.vertex(v).z);
    float* out = projections.data() + v * KdopAxes::most_axes;
    for (std::size_t a = 0; a < KdopAxes::most_axes; ++a) out[a] = axis[0][a] * x + axis[1][a] * y + axis[2][a] * z;
  });
  supports_.resize(tree_.nodes.size() * most_orientations, -std::numeric_limits<float>::infinity());
  for_each_node(0, tree_.nodes.size(), [&](std::size_t i) {
    if (tree_.nodes[i].child_count == 0) find_supports_of_leaf(i, projections);
  });
  merge_upwards([&](std::size_t parent, std::size_t child) {
    float* to = supports_.data() + parent * most_orientations;
    const float* from = supports_.data() + child * most_orientations;
    for (int o = 0; o < most_orientations; ++o) to[o] = std::max(to[o], from[o]);
  });
}

void BvhEncoder::find_supports_of_leaf(std::size_t node, const std::vector<float>& projections) {
  const CollisionMesh& mesh = *bvh_.mesh_;
  const float margin = support_margin * static_cast<float>(mesh.radius_m()) + absolute_margin_m;
  constexpr int n = KdopAxes::most_axes;
  float* out = supports_.data() + node * most_orientations;
  const BvhTree::Node& leaf = tree_.nodes[node];
  for (std::uint32_t t = 0; t < leaf.triangle_count; ++t) {
    for (const std::uint32_t v : mesh.triangle_vertices(tree_.triangle_order[leaf.first_triangle + t])) {
      const float* projection = projections.data() + std::size_t{v} * n;
      for (int a = 0; a < n; ++a) {
        out[a] = std::max(out[a], projection[a]);
        out[n + a] = std::max(out[n + a], -projection[a]);
      }
    }
  }
  for (int o = 0; o < most_orientations; ++o) out[o] += margin;
}

void BvhEncoder::link_node(std::size_t i) {
  const BvhTree::Node& from = tree_.nodes[i];
  BvhNode& node = bvh_.nodes_[i];
  node = {};
  node.is_leaf = from.child_count == 0;
  node.first = node.is_leaf ? from.first_triangle : from.first_child;
  node.count = static_cast<std::uint16_t>(node.is_leaf ? from.triangle_count : from.child_count);
}

void BvhEncoder::centre_node(std::size_t i) {
  const CollisionMesh& mesh = *bvh_.mesh_;
  const BvhTree::Node& from = tree_.nodes[i];
  BvhNode& node = bvh_.nodes_[i];
  Vec3d low = mesh.triangle(tree_.triangle_order[from.first_triangle])[0], high = low;
  for_each_corner(from, [&](const Vec3d& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  });
  for (int axis = 0; axis < 3; ++axis) node.origin[axis] = static_cast<float>((low[axis] + high[axis]) / 2);
  node.radius = static_cast<float>(norm((high - low) * 0.5) * (1 + 1e-6) + 1e-6 * mesh.radius_m());
}

double BvhEncoder::relative_support(std::size_t of, int orientation, const BvhNode& frame) const {
  const int n = bvh_.options_.axes.count();
  const std::size_t at =
      static_cast<std::size_t>(orientation < n ? orientation : KdopAxes::most_axes + orientation - n);
  const double support = supports_[of * most_orientations + at];
  return (support - dot(bvh_.options_.axes.orientation(orientation), frame.origin)) / frame.slab_unit;
}

template <class Slab>
void BvhEncoder::write_slabs(std::size_t i, AlignedVector<Slab>& own, AlignedVector<Slab>& child) {
  BvhNode& node = bvh_.nodes_[i];
  const BvhView view = bvh_.view();
  const int n = view.axis_count;
  node.slab_unit = 1;
  if (sizeof(Slab) == 2) {
    double most = 1e-30;
    for (int o = 0; o < 2 * n; ++o) most = std::max(most, std::abs(relative_support(i, o, node)));
    node.slab_unit = static_cast<float>(std::exp2(std::ceil(std::log2(most))));
  }
  Slab* to = own.data() + i * static_cast<std::size_t>(view.stride);
  std::fill_n(to, view.stride, Slab{});
  for (int o = 0; o < 2 * n; ++o) {
    to[o < n ? o : view.stride / 2 + o - n] = slab_not_below(relative_support(i, o, node), Slab{});
  }
  if (node.is_leaf || !has_rows()) return;
  Slab* rows = child.data() + std::size_t{node.first} * static_cast<std::size_t>(2 * n);
  for (int o = 0; o < 2 * n; ++o) {
    Slab* row = rows + (o < n ? 2 * o : 2 * (o - n) + 1) * node.count;
    for (std::size_t lane = 0; lane < node.count; ++lane) {
      row[lane] = slab_not_below(relative_support(node.first + lane, o, node), Slab{});
    }
  }
}

void BvhEncoder::write_integer_slabs(std::size_t i) {
  const BvhView view = bvh_.view();
  const double per_unit = 1 / static_cast<double>(bvh_.slab_unit_m_);
  std::int16_t* to = bvh_.own_i16_.data() + i * static_cast<std::size_t>(view.stride);
  std::fill_n(to, view.stride, std::int16_t{0});
  for (int side = 0; side < 2; ++side) {
    const float* from = supports_.data() + i * most_orientations + side * KdopAxes::most_axes;
    for (int axis = 0; axis < view.axis_count; ++axis) {
      const double value = std::ceil(static_cast<double>(from[axis]) * per_unit);
      to[side * view.stride / 2 + axis] = static_cast<std::int16_t>(std::min<double>(value, most_slab));
    }
  }
}

void BvhEncoder::write_leaf(std::size_t i) {
  const BvhNode& node = bvh_.nodes_[i];
  const bool has_boxes = bvh_.options_.traversal == Traversal::hybrid;
  const Vec3d axes[3] = {box_axis(node, 0), box_axis(node, 1), box_axis(node, 2)};
  float* to = bvh_.leaf_vertices_.data() + 9 * std::size_t{node.first};
  for (std::size_t t = 0; t < node.count; ++t) {
    const Triangle triangle = bvh_.mesh_->triangle(tree_.triangle_order[node.first + t]);
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3d at = triangle[corner] - Vec3d{node.origin[0], node.origin[1], node.origin[2]};
      for (std::size_t c = 0; c < 3; ++c) {
        const double along = has_boxes ? dot(at, axes[c]) : at[static_cast<int>(c)];
        to[(3 * corner + c) * node.count + t] = static_cast<float>(along);
      }
    }
  }
}

}  // namespace rayvox
