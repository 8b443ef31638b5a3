#include "rayvox/map_collision/link_body.hpp"

#include <algorithm>

#include "rayvox/error.hpp"

namespace rayvox {
namespace {

void put_box(BoxBlock& boxes, int lane, const BvhNode& node) {
  for (int c = 0; c < 3; ++c) {
    boxes.centre[c][lane] = node.origin[c];
    boxes.half[c][lane] = node.box_half[c];
    for (int j = 0; j < 3; ++j) boxes.axis[j][c][lane] = static_cast<float>(box_axis(node, j)[c]);
  }
}

}  // namespace

LinkBody::LinkBody(std::shared_ptr<const KdopBvh> bvh) : LinkBody(bvh, std::make_shared<const LinkSolid>(bvh)) {}

LinkBody::LinkBody(std::shared_ptr<const KdopBvh> surface, const LinkBody& detailed)
    : LinkBody(std::move(surface), detailed.solid_) {}

LinkBody::LinkBody(std::shared_ptr<const KdopBvh> bvh, std::shared_ptr<const LinkSolid> solid)
    : bvh_(std::move(bvh)), solid_(std::move(solid)) {
  if (bvh_->options().traversal != Traversal::hybrid) {
    throw InvalidInput("a mesh that collides with maps needs a hierarchy for hybrid traversal");
  }
  const BvhNode& root = bvh_->nodes()[0];
  blocks_.emplace_back();
  Block around{};
  put_box(around.boxes, 0, root);
  add_child(around, 0, 0);
  blocks_[0] = around;
}

void LinkBody::add_child(Block& block, int lane, std::uint32_t node) {
  const BvhNode& child = bvh_->nodes()[node];
  const auto bit = static_cast<std::uint16_t>(1u << lane);
  if (child.is_leaf) {
    block.leaves |= bit;
    block.child[lane] = add_leaf(node);
  } else {
    block.inner |= bit;
    block.largest_radius_m = std::max(block.largest_radius_m, child.radius);
    block.child[lane] = add_block(node);
  }
}

std::uint32_t LinkBody::add_block(std::uint32_t index) {
  const BvhNode& node = bvh_->nodes()[index];
  const std::size_t at = blocks_.size();
  blocks_.emplace_back();
  Block block{};
  for (int lane = 0; lane < node.count; ++lane) {
    put_box(block.boxes, lane, bvh_->nodes()[node.first + static_cast<std::uint32_t>(lane)]);
    add_child(block, lane, node.first + static_cast<std::uint32_t>(lane));
  }
  blocks_[at] = block;
  return static_cast<std::uint32_t>(at);
}

std::uint32_t LinkBody::add_leaf(std::uint32_t index) {
  const BvhNode& node = bvh_->nodes()[index];
  Leaf leaf{};
  leaf.first = node.first;
  leaf.count = node.count;
  for (std::uint32_t i = 0; i < node.count; ++i) {
    const Triangle triangle = bvh_->mesh().triangle(bvh_->triangle_at(node.first + i));
    for (std::size_t k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) leaf.triangles.corner[k][c][i] = static_cast<float>(triangle[k][c]);
    }
  }
  leaves_.push_back(leaf);
  return static_cast<std::uint32_t>(leaves_.size() - 1);
}

}  // namespace rayvox
