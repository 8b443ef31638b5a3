#include "rayvox/map_collision/octree_descent.hpp"

#include <limits>

namespace rayvox {
namespace {

// Boxes larger than the voxel are opened, smaller ones carried on: both shrink together.
constexpr float opened_radius_of_half_edge = 2;

}  // namespace

void OctreeDescent::start_pose(std::uint32_t pose) {
  pose_ = pose;
  first_contact_ = contacts_.size();
  occupied_ = unknown_ = false;
}

bool OctreeDescent::check_link(PlacedBody& body, std::uint32_t link) {
  body_ = &body;
  link_ = link;
  untouched_.clear();
  bool may_reach_beyond;
  reach_ = body.cells_in_reach(may_reach_beyond);
  if (options_.unknown_is_occupied && may_reach_beyond && !unknown_ && body.reaches_beyond_map()) unknown_ = true;
  if (reach_.empty()) return done();
  front_.assign(1, {0, 1});
  const NodeCursor root(map_.root, map_.geometry.depth());
  if (relevance(root)) descend(root, root_cell(map_.geometry), {0, 1});
  if (!done()) check_enclosed();
  return done();
}

OctreeDescent::Relevance OctreeDescent::relevance(const NodeCursor& node) const {
  const bool unknown_counts = options_.unknown_is_occupied && (!unknown_ || options_.contacts == Contacts::all);
  if (node.kind() == NodeCursor::Kind::unknown) return {false, unknown_counts};
  const bool occupied = node.log_odds() >= options_.occupied_log_odds;
  const bool inner = node.kind() == NodeCursor::Kind::inner;
  return {occupied, unknown_counts && inner && node.any_unknown()};
}

void OctreeDescent::descend(const NodeCursor& node, const Cell& first, Front front) {
  const PlacedCube cube = body_->cube(first, node.level());
  const Front here = narrow(front, cube);
  if (here.begin == here.end) {
    leave_untouched(node, first);
  } else if (node.kind() == NodeCursor::Kind::inner) {
    descend_children(node, first, here);
  } else if (surface_meets(here, cube)) {
    report(node, first);
  } else {
    leave_untouched(node, first);
  }
  front_.resize(here.begin);
}

void OctreeDescent::descend_children(const NodeCursor& node, const Cell& first, Front front) {
  for (int i = 0; i < 8 && !done(); ++i) {
    const Cell child_first = child_cell(first, node.level(), i);
    if (!reach_.overlaps(child_first, node.level() - 1)) continue;
    const NodeCursor child = node.child(i);
    if (relevance(child)) descend(child, child_first, front);
  }
}

OctreeDescent::Front OctreeDescent::narrow(Front front, const PlacedCube& cube) {
  const std::size_t begin = front_.size();
  for (std::size_t i = front.begin; i < front.end; ++i) {
    const Entry entry = front_[i];
    const std::uint32_t lanes = entry.lanes & body_->lanes_meeting(entry.block, cube);
    if (lanes) front_.push_back({entry.block, lanes});
  }
  // Entries are opened in place; those of their children are appended, and opened when their turn comes.
  for (std::size_t i = begin; i < front_.size(); ++i) {
    const LinkBody::Block& block = body_->body().blocks()[front_[i].block];
    if (block.largest_radius_m <= opened_radius_of_half_edge * cube.local.half) continue;
    std::uint32_t opened = front_[i].lanes & block.inner;
    front_[i].lanes &= block.leaves;
    for (; opened; opened &= opened - 1) {
      const std::uint32_t child = block.child[__builtin_ctz(opened)];
      const std::uint32_t lanes = body_->lanes_meeting(child, cube);
      if (lanes) front_.push_back({child, lanes});
    }
  }
  std::size_t end = begin;
  for (std::size_t i = begin; i < front_.size(); ++i) {
    if (front_[i].lanes) front_[end++] = front_[i];
  }
  front_.resize(end);
  return {begin, end};
}

bool OctreeDescent::surface_meets(Front front, const PlacedCube& cube) {
  for (std::size_t i = front.begin; i < front_.size(); ++i) {
    const Entry entry = front_[i];
    const LinkBody::Block& block = body_->body().blocks()[entry.block];
    for (std::uint32_t leaves = entry.lanes & block.leaves; leaves; leaves &= leaves - 1) {
      if (body_->leaf_meets(block.child[__builtin_ctz(leaves)], cube)) return true;
    }
    for (std::uint32_t inner = entry.lanes & block.inner; inner; inner &= inner - 1) {
      const std::uint32_t child = block.child[__builtin_ctz(inner)];
      const std::uint32_t lanes = body_->lanes_meeting(child, cube);
      if (lanes) front_.push_back({child, lanes});
    }
  }
  return false;
}

void OctreeDescent::leave_untouched(const NodeCursor& node, const Cell& first) {
  if (body_->body().solid().exists()) untouched_.push_back({node, first});
}

void OctreeDescent::check_enclosed() {
  // No triangle meets the cube, so it lies inside with its centre or outside with it.
  for (const Untouched& at : untouched_) {
    if (done()) return;
    if (relevance(at.node) && body_->encloses(body_->cube(at.first, at.node.level()))) report_all(at.node, at.first);
  }
}

void OctreeDescent::report_all(const NodeCursor& node, const Cell& first) {
  if (!relevance(node)) return;
  if (node.kind() != NodeCursor::Kind::inner) return report(node, first);
  for (int i = 0; i < 8 && !done(); ++i) report_all(node.child(i), child_cell(first, node.level(), i));
}

void OctreeDescent::report(const NodeCursor& leaf, const Cell& first) {
  const bool is_unknown = leaf.kind() == NodeCursor::Kind::unknown;
  (is_unknown ? unknown_ : occupied_) = true;
  if (options_.contacts == Contacts::none) return;
  // An occupied voxel takes the place of an unknown one.
  if (options_.contacts == Contacts::first) contacts_.resize(first_contact_);
  contacts_.push_back(
      {pose_, link_, first, leaf.level(), is_unknown ? std::numeric_limits<float>::quiet_NaN() : leaf.log_odds()});
}

}  // namespace rayvox
