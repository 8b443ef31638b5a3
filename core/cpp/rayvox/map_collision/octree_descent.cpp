#include "rayvox/map_collision/octree_descent.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace rayvox {
namespace {

// Boxes larger than the voxel are opened, smaller ones carried on: both shrink together.
constexpr float opened_radius_of_half_edge = 2;

constexpr int octant_level = 2;
// As Untouched::cells: not an octant's cells.
constexpr std::uint64_t whole_node = 0;

Cell cell_in_octant(const Cell& first, int cell) {
  return child_cell(child_cell(first, octant_level, cell / 8), octant_level - 1, cell % 8);
}

bool any_unknown_below(const NodeCursor& node) {
  if (!node.brick()) return node.slot().inner()->summary.any_unknown;
  if (node.level() == brick_level) return node.brick()->any_unknown();
  const std::uint64_t known = node.brick()->known[node.first_cell() / cells_per_octant];
  if (node.level() == 2) return ~known != 0;
  return (~known >> (node.first_cell() % cells_per_octant) & 0xff) != 0;
}

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
  std::int32_t longest = 0;
  for (std::size_t c = 0; c < 3; ++c) longest = std::max(longest, reach_.high[c] - reach_.low[c]);
  body_level_ = std::max<int>(brick_level, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(longest))));
  front_.assign(1, {0, 1});
  const NodeCursor root(map_.root, map_.geometry.depth());
  if (relevance(root)) approach(root, root_cell(map_.geometry));
  if (!done()) check_enclosed();
  return done();
}

OctreeDescent::Relevance OctreeDescent::relevance(const NodeCursor& node) const {
  if (node.kind() == NodeCursor::Kind::unknown) return {false, unknown_counts()};
  const bool occupied = node.log_odds() >= options_.occupied_log_odds;
  const bool inner = node.kind() == NodeCursor::Kind::inner;
  return {occupied, unknown_counts() && inner && any_unknown_below(node)};
}

unsigned OctreeDescent::children_in_reach(const Cell& first, int level) const {
  constexpr unsigned side[3][2] = {{0x55, 0xaa}, {0x33, 0xcc}, {0x0f, 0xf0}};
  unsigned children = 0xff;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::int32_t middle = first[c] + (std::int32_t{1} << (level - 1));
    children &= (reach_.low[c] < middle ? side[c][0] : 0) | (reach_.high[c] >= middle ? side[c][1] : 0);
  }
  return children;
}

void OctreeDescent::approach(const NodeCursor& node, const Cell& first) {
  if (node.kind() != NodeCursor::Kind::inner || node.level() <= body_level_) return descend(node, first, {0, 1});
  for (unsigned left = children_in_reach(first, node.level()); left && !done(); left &= left - 1) {
    const NodeCursor child = node.child(__builtin_ctz(left));
    if (relevance(child)) approach(child, child_cell(first, node.level(), __builtin_ctz(left)));
  }
}

void OctreeDescent::descend(const NodeCursor& node, const Cell& first, Front front) {
  const PlacedCube cube = body_->cube(first, node.level());
  const Front here = narrow(front, cube);
  if (here.begin == here.end) {
    leave_untouched(node, first, whole_node);
  } else if (node.kind() == NodeCursor::Kind::inner) {
    node.level() == octant_level ? check_octant(node, first, here) : descend_children(node, first, here);
  } else if (surface_meets(here, cube)) {
    report(node, first);
  } else {
    leave_untouched(node, first, whole_node);
  }
  front_.resize(here.begin);
}

void OctreeDescent::descend_children(const NodeCursor& node, const Cell& first, Front front) {
  for (unsigned left = children_in_reach(first, node.level()); left && !done(); left &= left - 1) {
    const NodeCursor child = node.child(__builtin_ctz(left));
    if (relevance(child)) descend(child, child_cell(first, node.level(), __builtin_ctz(left)), front);
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

void OctreeDescent::check_octant(const NodeCursor& octant, const Cell& first, Front front) {
  const Brick& brick = *octant.brick();
  const int index = octant.first_cell() / cells_per_octant;
  const std::uint64_t known = brick.known[index];
  const std::uint64_t occupied = known & kernels_.values_at_least(brick.cells(index), options_.occupied_log_odds);
  octant_ = {first, body_->cube(first, octant_level), body_->cells(first)};
  if (options_.contacts == Contacts::all) {
    check_cells(octant, front, occupied | (unknown_counts() ? ~known : 0));
    return;
  }
  // What one kind's first contact decides, the other's cannot.
  check_cells(octant, front, occupied);
  if (!done() && unknown_counts()) check_cells(octant, front, ~known);
}

void OctreeDescent::check_cells(const NodeCursor& octant, Front front, std::uint64_t cells) {
  std::uint64_t met = 0;
  for (std::size_t i = front.begin; i < front.end && cells && !enough(met); ++i) {
    met |= cells_met_by_block(front_[i].block, front_[i].lanes, cells & ~met);
  }
  if (options_.contacts == Contacts::all) met = whole_leaves(octant, met);
  report_cells(octant, octant_.first, met);
  if (cells & ~met) leave_untouched(octant, octant_.first, cells & ~met);
}

std::uint64_t OctreeDescent::cells_met_by_block(std::uint32_t block, std::uint32_t lanes, std::uint64_t cells) {
  std::uint64_t met = 0;
  for (; lanes && !enough(met); lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    const std::uint64_t near = body_->cells_meeting(block, lane, octant_.cells) & cells & ~met;
    if (!near) continue;
    const LinkBody::Block& boxes = body_->body().blocks()[block];
    if (boxes.leaves >> lane & 1) {
      met |= cells_met_by_leaf(boxes.child[lane], near);
    } else {
      const PlacedCube cube = std::has_single_bit(near) ? cell_cube(octant_.first, near) : octant_.cube;
      met |= cells_met_by_block(boxes.child[lane], body_->lanes_meeting(boxes.child[lane], cube), near);
    }
  }
  return met;
}

std::uint64_t OctreeDescent::cells_met_by_leaf(std::uint32_t leaf, std::uint64_t cells) {
  std::uint64_t met = 0;
  for (; cells && !enough(met); cells &= cells - 1) {
    if (body_->leaf_meets(leaf, cell_cube(octant_.first, cells))) met |= cells & (~cells + 1);
  }
  return met;
}

PlacedCube OctreeDescent::cell_cube(const Cell& octant_first, std::uint64_t cells) const {
  return body_->cube(cell_in_octant(octant_first, std::countr_zero(cells)), 0);
}

void OctreeDescent::leave_untouched(const NodeCursor& node, const Cell& first, std::uint64_t cells) {
  if (body_->body().solid().exists()) untouched_.push_back({node, first, cells});
}

void OctreeDescent::check_enclosed() {
  // No triangle meets the cube, so it lies inside with its centre or outside with it.
  for (const Untouched& at : untouched_) {
    if (done()) return;
    const PlacedCube cube = body_->cube(at.first, at.node.level());
    if (at.cells != whole_node) {
      if (body_->may_enclose_any(cube)) check_cells_enclosed(at);
    } else if (body_->encloses(cube)) {
      report_all(at.node, at.first);
    }
  }
}

void OctreeDescent::check_cells_enclosed(const Untouched& octant) {
  std::uint64_t inside = 0;
  for (std::uint64_t cells = octant.cells; cells && !enough(inside); cells &= cells - 1) {
    if (body_->encloses(cell_cube(octant.first, cells))) inside |= cells & (~cells + 1);
  }
  report_cells(octant.node, octant.first, inside);
}

void OctreeDescent::report_all(const NodeCursor& node, const Cell& first) {
  if (!relevance(node)) return;
  if (node.kind() != NodeCursor::Kind::inner) return report(node, first);
  for (int i = 0; i < 8 && !done(); ++i) report_all(node.child(i), child_cell(first, node.level(), i));
}

std::uint64_t OctreeDescent::whole_leaves(const NodeCursor& octant, std::uint64_t cells) {
  for (int i = 0; i < 8; ++i) {
    const std::uint64_t group = std::uint64_t{0xff} << (8 * i);
    if ((cells & group) && octant.child(i).kind() != NodeCursor::Kind::inner) cells |= group;
  }
  return cells;
}

void OctreeDescent::report_cells(const NodeCursor& octant, const Cell& first, std::uint64_t cells) {
  for (; cells; cells &= cells - 1) {
    const int cell = std::countr_zero(cells), index = cell / 8;
    const NodeCursor group = octant.child(index);
    if (group.kind() == NodeCursor::Kind::inner) {
      report(group.child(cell % 8), cell_in_octant(first, cell));
    } else {
      report(group, child_cell(first, octant_level, index));
      cells &= ~(std::uint64_t{0xfe} << (8 * index)) | std::uint64_t{1} << cell;
    }
  }
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
