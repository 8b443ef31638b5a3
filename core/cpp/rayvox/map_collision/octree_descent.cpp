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
  if (counts(root)) approach(root, root_cell(map_.geometry));
  if (!done()) check_enclosed();
  return done();
}

bool OctreeDescent::counts(const NodeCursor& node) const {
  switch (node.kind()) {
    case NodeCursor::Kind::unknown: return unknown_counts();
    case NodeCursor::Kind::leaf: return node.log_odds() >= options_.occupied_log_odds;
    default: break;
  }
  if (node.level() > brick_level) {
    const Summary& summary = node.slot().inner()->summary;
    return summary.max_log_odds >= options_.occupied_log_odds || (summary.any_unknown && unknown_counts());
  }
  if (node.level() == brick_level) return octants_that_count(*node.brick()) != 0;
  const std::uint64_t cells =
      node.level() == octant_level ? ~std::uint64_t{0} : std::uint64_t{0xff} << node.first_cell() % cells_per_octant;
  const std::uint64_t unknown = ~node.brick()->known[node.first_cell() / cells_per_octant] & cells;
  return node.log_odds() >= options_.occupied_log_odds || (unknown && unknown_counts());
}

unsigned OctreeDescent::octants_that_count(const Brick& brick) const {
  const std::uint64_t all_unknown = unknown_counts() ? ~std::uint64_t{0} : 0;
  unsigned octants = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const bool occupied = (brick.known[i] != 0) & (brick.octant_max[i] >= options_.occupied_log_odds);
    octants |= static_cast<unsigned>(occupied | ((~brick.known[i] & all_unknown) != 0)) << i;
  }
  return octants;
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
    if (counts(child)) approach(child, child_cell(first, node.level(), __builtin_ctz(left)));
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
  unsigned left = children_in_reach(first, node.level());
  if (node.level() == brick_level) left &= octants_that_count(*node.brick());
  for (; left && !done(); left &= left - 1) {
    const NodeCursor child = node.child(__builtin_ctz(left));
    if (node.level() == brick_level || counts(child)) {
      descend(child, child_cell(first, node.level(), __builtin_ctz(left)), front);
    }
  }
}

OctreeDescent::Front OctreeDescent::narrow(Front front, const PlacedCube& cube) {
  const std::size_t begin = front_.size();
  for (std::size_t i = front.begin; i < front.end; ++i) {
    const Entry entry = front_[i];
    const std::uint32_t lanes = entry.lanes & body_->lanes_meeting(entry.block, cube.local);
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
      const std::uint32_t lanes = body_->lanes_meeting(child, cube.local);
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
      const std::uint32_t leaf = block.child[__builtin_ctz(leaves)], near = body_->triangles_near(leaf, cube.local);
      if (near && body_->triangles_meet(leaf, near, cube)) return true;
    }
    for (std::uint32_t inner = entry.lanes & block.inner; inner; inner &= inner - 1) {
      const std::uint32_t child = block.child[__builtin_ctz(inner)];
      const std::uint32_t lanes = body_->lanes_meeting(child, cube.local);
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
  octant_ = {first, body_->cube(first, octant_level).local, body_->cells(first)};
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
    const std::uint64_t near = body_->cells_meeting(block, lane, octant_.cells, cells & ~met);
    if (!near) continue;
    const LinkBody::Block& boxes = body_->body().blocks()[block];
    if (boxes.leaves >> lane & 1) {
      met |= cells_met_by_leaf(boxes.child[lane], near);
    } else {
      const LocalCube around = (near & (near - 1)) == 0 ? octant_.cells.cube(std::countr_zero(near)) : octant_.cube;
      met |= cells_met_by_block(boxes.child[lane], body_->lanes_meeting(boxes.child[lane], around), near);
    }
  }
  return met;
}

std::uint64_t OctreeDescent::cells_met_by_leaf(std::uint32_t leaf, std::uint64_t cells) {
  std::uint64_t met = 0;
  for (; cells && !enough(met); cells &= cells - 1) {
    const int cell = std::countr_zero(cells);
    const std::uint32_t near = body_->triangles_near(leaf, octant_.cells.cube(cell));
    if (near && body_->triangles_meet(leaf, near, cell_cube(octant_.first, cell))) met |= cells & (~cells + 1);
  }
  return met;
}

PlacedCube OctreeDescent::cell_cube(const Cell& octant_first, int cell) const {
  return body_->cube(cell_in_octant(octant_first, cell), 0);
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
    if (body_->encloses(cell_cube(octant.first, std::countr_zero(cells)))) inside |= cells & (~cells + 1);
  }
  report_cells(octant.node, octant.first, inside);
}

void OctreeDescent::report_all(const NodeCursor& node, const Cell& first) {
  if (!counts(node)) return;
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
