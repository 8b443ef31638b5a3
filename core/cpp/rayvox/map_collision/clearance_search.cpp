#include "rayvox/map_collision/clearance_search.hpp"

#include <algorithm>
#include <cmath>

namespace rayvox {
namespace {

constexpr auto is_farther = [](const auto& a, const auto& b) { return a.squared > b.squared; };

}  // namespace

PoseClearance ClearanceSearch::nearest_voxel(std::span<PlacedBody> bodies) {
  start(bodies);
  for (Pair pair; pop(pair);) {
    if (pair.body == whole_robot) {
      expand_robot(pair);
    } else {
      expand(pair);
    }
  }
  if (options_.unknown_is_occupied) measure_borders();
  found_.clearance_m = nearest_.distance;
  found_.is_lower_bound = found_.link < 0;
  return found_;
}

void ClearanceSearch::start(std::span<PlacedBody> bodies) {
  bodies_ = bodies;
  bounds_.clear();
  queue_.clear();
  nearest_ = {options_.max_clearance_m, {}, {}};
  found_ = {};
  robot_ = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  for (PlacedBody& body : bodies) {
    const auto [low, high] = body.bounds();
    bounds_.push_back({low, high});
    for (int c = 0; c < 3; ++c) {
      robot_.low[c] = std::min(robot_.low[c], low[c]);
      robot_.high[c] = std::max(robot_.high[c], high[c]);
    }
  }
  const NodeCursor root(map_.root, map_.geometry.depth());
  if (!bodies.empty() && counts(root)) push({0, whole_robot, 0, 0, root, root_cell(map_.geometry)});
}

bool ClearanceSearch::pop(Pair& pair) {
  if (queue_.empty() || queue_.front().squared >= squared_limit(whole_robot)) return false;
  std::pop_heap(queue_.begin(), queue_.end(), is_farther);
  pair = queue_.back();
  queue_.pop_back();
  return true;
}

void ClearanceSearch::push(const Pair& pair) {
  if (pair.squared >= squared_limit(whole_robot)) return;
  queue_.push_back(pair);
  std::push_heap(queue_.begin(), queue_.end(), is_farther);
}

// The robot is one box to nodes that are larger.
void ClearanceSearch::expand_robot(const Pair& pair) {
  const Vec3d size = robot_.high - robot_.low;
  const double node_m = std::ldexp(map_.geometry.resolution_m(), pair.node.level());
  if (pair.node.kind() == NodeCursor::Kind::inner && node_m > std::max({size.x, size.y, size.z})) {
    for (int i = 0; i < 8; ++i) {
      const NodeCursor child = pair.node.child(i);
      const Cell first = child_cell(pair.first, pair.node.level(), i);
      if (counts(child)) push({squared_gap(robot_, first, child.level()), whole_robot, 0, 0, child, first});
    }
    return;
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const float squared = squared_gap(bounds_[i], pair.first, pair.node.level());
    push({squared, static_cast<std::int32_t>(i), 0, 1, pair.node, pair.first});
  }
}

// The larger of node and boxes is opened.
void ClearanceSearch::expand(const Pair& pair) {
  PlacedBody& body = bodies_[static_cast<std::size_t>(pair.body)];
  const LinkBody::Block& block = body.body().blocks()[pair.block];
  const PlacedCube cube = body.cube(pair.first, pair.node.level());
  const bool is_inner = pair.node.kind() == NodeCursor::Kind::inner;
  const bool node_is_larger = !(pair.lanes & block.inner) || cube.local.half > block.largest_radius_m;
  if (is_inner && node_is_larger) return open_node(pair, pair.lanes);
  open_boxes(pair, cube, pair.lanes & block.inner);
  const std::uint32_t leaves = pair.lanes & block.leaves;
  if (is_inner) {
    open_node(pair, leaves);
  } else {
    measure_leaves(pair, cube, leaves);
  }
}

void ClearanceSearch::open_node(const Pair& pair, std::uint32_t lanes) {
  if (lanes == 0) return;
  PlacedBody& body = bodies_[static_cast<std::size_t>(pair.body)];
  for (int i = 0; i < 8; ++i) {
    const NodeCursor child = pair.node.child(i);
    if (!counts(child)) continue;
    const Cell first = child_cell(pair.first, pair.node.level(), i);
    push_near({0, pair.body, pair.block, lanes, child, first}, body.cube(first, child.level()));
  }
}

void ClearanceSearch::open_boxes(const Pair& pair, const PlacedCube& cube, std::uint32_t lanes) {
  const LinkBody::Block& block = bodies_[static_cast<std::size_t>(pair.body)].body().blocks()[pair.block];
  for (; lanes; lanes &= lanes - 1) {
    const std::uint32_t child = block.child[__builtin_ctz(lanes)];
    push_near({0, pair.body, child, ~0u, pair.node, pair.first}, cube);
  }
}

// Queues those of the lanes that may be nearer than what is found.
void ClearanceSearch::push_near(const Pair& pair, const PlacedCube& cube) {
  PlacedBody& body = bodies_[static_cast<std::size_t>(pair.body)];
  alignas(64) float squared[16];
  Pair near = pair;
  near.lanes &= body.lanes_near(pair.block, cube, squared_limit(pair.body), squared);
  if (near.lanes == 0) return;
  near.squared = INFINITY;
  for (std::uint32_t lanes = near.lanes; lanes; lanes &= lanes - 1) {
    near.squared = std::min(near.squared, squared[__builtin_ctz(lanes)]);
  }
  near.squared *= body.scale_of_squares();
  push(near);
}

void ClearanceSearch::measure_leaves(const Pair& pair, const PlacedCube& cube, std::uint32_t lanes) {
  PlacedBody& body = bodies_[static_cast<std::size_t>(pair.body)];
  alignas(64) float squared[16];
  lanes &= body.lanes_near(pair.block, cube, squared_limit(pair.body), squared);
  for (; lanes; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    if (squared[lane] >= squared_limit(pair.body)) continue;
    const std::uint32_t leaf = body.body().blocks()[pair.block].child[lane];
    if (!body.lower_to_leaf(leaf, cube, nearest_)) continue;
    found_.link = pair.body;
    found_.point_m = nearest_.on_triangle + cube.centre + body.translation();
    const Vec3d gap = nearest_.on_cube - nearest_.on_triangle;
    found_.direction = gap * (1 / norm(gap));
    found_.first = pair.first;
    found_.level = pair.node.level();
  }
}

void ClearanceSearch::measure_borders() {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Separation border = bodies_[i].distance_to_border(nearest_.distance);
    if (border.distance >= nearest_.distance) continue;
    nearest_ = border;
    found_.link = static_cast<std::int32_t>(i);
    found_.point_m = border.on_triangle + bodies_[i].translation();
    const Vec3d gap = border.on_cube - border.on_triangle;
    found_.direction = gap * (1 / norm(gap));
    found_.level = -1;
  }
}

bool ClearanceSearch::counts(const NodeCursor& node) const {
  if (node.kind() == NodeCursor::Kind::unknown) return options_.unknown_is_occupied;
  if (node.log_odds() >= options_.occupied_log_odds) return true;
  return options_.unknown_is_occupied && node.kind() == NodeCursor::Kind::inner && node.any_unknown();
}

float ClearanceSearch::squared_gap(const Box& box, const Cell& first, int level) const {
  const double r = map_.geometry.resolution_m(), edge = std::ldexp(r, level);
  double squared = 0;
  for (int c = 0; c < 3; ++c) {
    const double low = first[static_cast<std::size_t>(c)] * r;
    const double gap = std::max({box.low[c] - (low + edge), low - box.high[c], 0.0});
    squared += gap * gap;
  }
  return static_cast<float>(squared * (1 - 1e-6));
}

// Bounds of this or more need not be looked at: those of the kernels for a body, others for the whole robot.
float ClearanceSearch::squared_limit(std::int32_t body) const {
  const auto squared = static_cast<float>(nearest_.distance * nearest_.distance);
  return body == whole_robot ? squared : squared / bodies_[static_cast<std::size_t>(body)].scale_of_squares();
}

}  // namespace rayvox
