#include "rayvox/collision/kdop_bvh.hpp"

#include <string>

#include "rayvox/collision/bvh_encoder.hpp"
#include "rayvox/collision/half_float.hpp"
#include "rayvox/error.hpp"

namespace rayvox {
namespace {

void require_valid(const BvhOptions& options) {
  const int b = options.branching_factor;
  if (b != 2 && b != 4 && b != 8 && b != 16) {
    throw InvalidInput("branching factor must be 2, 4, 8 or 16, got " + std::to_string(b));
  }
  if (options.leaf_size < 1 || options.leaf_size > 16) {
    throw InvalidInput("leaf size must be 1 to 16 triangles, got " + std::to_string(options.leaf_size));
  }
  if (options.traversal == Traversal::four_vs_four && b != 4) {
    throw InvalidInput("4vs4 traversal needs branching factor 4, got " + std::to_string(b));
  }
  if (options.construction == Construction::surface_area_heuristic && b != 2) {
    throw InvalidInput("the surface area heuristic builds binary trees; branching factor is " + std::to_string(b));
  }
}

int stride_of(int axes) { return axes <= 8 ? 16 : 32; }

float as_float(float value) { return value; }
float as_float(std::uint16_t value) { return half_to_float(value); }

}  // namespace

Vec3d box_axis(const BvhNode& node, int index) {
  const float *u = node.box_axis, *v = u + 3;
  const Vec3d first{u[0], u[1], u[2]}, second{v[0], v[1], v[2]};
  if (index < 2) return index == 0 ? first : second;
  return {first.y * second.z - first.z * second.y, first.z * second.x - first.x * second.z,
          first.x * second.y - first.y * second.x};
}

KdopBvh::KdopBvh(std::shared_ptr<const CollisionMesh> mesh, const BvhOptions& options)
    : mesh_(std::move(mesh)), options_(options) {
  require_valid(options);
  BvhTree tree = build_tree(*mesh_, options_);
  BvhEncoder(*this, tree).run();
  triangle_order_ = std::move(tree.triangle_order);
  depth_ = static_cast<int>(tree.level_begin.size()) - 2;
}

std::size_t KdopBvh::nbytes() const {
  return nodes_.size() * sizeof(BvhNode) +
         (own_f32_.size() + child_f32_.size() + leaf_vertices_.size()) * sizeof(float) +
         (own_f16_.size() + child_f16_.size() + own_i16_.size()) * 2 + triangle_order_.size() * 4;
}

BvhView KdopBvh::view() const {
  const bool hybrid = options_.traversal == Traversal::hybrid;
  const bool half = !hybrid && options_.slabs == SlabFormat::float16, single = !hybrid && !half;
  const int axes = options_.axes.count();
  return {.nodes = nodes_.data(),
          .has_boxes = hybrid,
          .slabs_f32 = {single ? own_f32_.data() : nullptr, single ? child_f32_.data() : nullptr},
          .slabs_f16 = {half ? own_f16_.data() : nullptr, half ? child_f16_.data() : nullptr},
          .slabs_i16 = {hybrid ? own_i16_.data() : nullptr, slab_unit_m_},
          .leaf_vertices = leaf_vertices_.data(),
          .axis_count = axes,
          .stride = stride_of(axes)};
}

double KdopBvh::support(std::size_t node, int orientation) const {
  const int axes = options_.axes.count(), stride = stride_of(axes);
  const int slot = orientation < axes ? orientation : stride / 2 + orientation - axes;
  const std::size_t at = node * static_cast<std::size_t>(stride) + static_cast<std::size_t>(slot);
  if (!own_i16_.empty()) return static_cast<double>(own_i16_[at]) * static_cast<double>(slab_unit_m_);
  const Vec3d d = options_.axes.orientation(orientation);
  const BvhNode& n = nodes_[node];
  const double slab = own_f32_.empty() ? as_float(own_f16_[at]) : as_float(own_f32_[at]);
  return slab * n.slab_unit + d.x * n.origin[0] + d.y * n.origin[1] + d.z * n.origin[2];
}

std::vector<double> KdopBvh::supports(std::size_t node) const {
  std::vector<double> out;
  for (int o = 0; o < options_.axes.k(); ++o) out.push_back(support(node, o));
  return out;
}

std::vector<double> KdopBvh::block_supports(std::size_t parent, int lane) const {
  const BvhView v = view();
  const BvhNode& n = nodes_[parent];
  std::vector<double> out;
  for (int o = 0; o < options_.axes.k(); ++o) {
    const int row = o < v.axis_count ? 2 * o : 2 * (o - v.axis_count) + 1;
    const std::size_t at = std::size_t{n.first} * static_cast<std::size_t>(2 * v.axis_count) +
                           static_cast<std::size_t>(row * n.count + lane);
    const Vec3d d = options_.axes.orientation(o);
    const double slab = child_f32_.empty() ? as_float(child_f16_[at]) : as_float(child_f32_[at]);
    out.push_back(slab * n.slab_unit + d.x * n.origin[0] + d.y * n.origin[1] + d.z * n.origin[2]);
  }
  return out;
}

}  // namespace rayvox
