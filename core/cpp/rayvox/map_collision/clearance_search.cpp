#include "rayvox/map_collision/clearance_search.hpp"

#include <algorithm>
#include <cmath>

namespace rayvox {
namespace {

constexpr auto is_nearer = [](const auto& a, const auto& b) { return a.squared < b.squared; };
constexpr auto is_farther = [](const auto& a, const auto& b) { return a.squared > b.squared; };

}  // namespace

PoseClearance ClearanceSearch::nearest_voxel(std::span<PlacedBody> bodies) {
  start(bodies);
  // The sooner a distance is known, the less is queued that is farther: first straight down.
  for (Pair pair; found_.link < 0 && pop_newest(pair);) expand(pair);
  order_queue();
  for (Pair pair; pop_nearest(pair);) expand(pair);
  if (options_.unknown_is_occupied) measure_borders();
  found_.clearance_m = nearest_.distance;
  found_.is_lower_bound = found_.link < 0;
  return found_;
}

void ClearanceSearch::start(std::span<PlacedBody> bodies) {
  bodies_ = bodies;
  bounds_.clear();
  pairs_.clear();
  queue_.clear();
  newest_ = 0;
  is_heap_ = false;
  nearest_ = {std::min(options_.max_clearance_m, farthest_clearance_m), {}, {}};
  squared_limit_ = static_cast<float>(nearest_.distance * nearest_.distance);
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
  if (!bodies.empty() && counts(root)) push(0, {whole_robot, {}, root, root_cell(map_.geometry)});
}

// The nearest of what was queued since the last time; false if that was nothing.
bool ClearanceSearch::pop_newest(Pair& pair) {
  if (newest_ == queue_.size()) return false;
  const auto newest = queue_.begin() + static_cast<std::ptrdiff_t>(newest_);
  std::iter_swap(std::min_element(newest, queue_.end(), is_nearer), queue_.end() - 1);
  pair = pairs_[queue_.back().pair];
  queue_.pop_back();
  newest_ = queue_.size();
  return true;
}

void ClearanceSearch::order_queue() {
  std::erase_if(queue_, [&](const Bound& bound) { return bound.squared >= squared_limit_; });
  std::make_heap(queue_.begin(), queue_.end(), is_farther);
  is_heap_ = true;
}

bool ClearanceSearch::pop_nearest(Pair& pair) {
  if (queue_.empty() || queue_.front().squared >= squared_limit_) return false;
  std::pop_heap(queue_.begin(), queue_.end(), is_farther);
  pair = pairs_[queue_.back().pair];
  queue_.pop_back();
  return true;
}

void ClearanceSearch::push(float squared, const Pair& pair) {
  if (squared >= squared_limit_) return;
  queue_.push_back({squared, static_cast<std::uint32_t>(pairs_.size())});
  pairs_.push_back(pair);
  if (is_heap_) std::push_heap(queue_.begin(), queue_.end(), is_farther);
}

void ClearanceSearch::expand(const Pair& pair) {
  if (pair.body == whole_robot) {
    expand_robot(pair);
  } else {
    expand_body(pair);
  }
}

// The robot is one box to nodes that are larger.
void ClearanceSearch::expand_robot(const Pair& pair) {
  const Vec3d size = robot_.high - robot_.low;
  const int level = pair.node.level();
  const double node_m = std::ldexp(map_.geometry.resolution_m(), level);
  if (pair.node.kind() == NodeCursor::Kind::inner && node_m > std::max({size.x, size.y, size.z})) {
    for (unsigned children = counting_children(pair.node); children; children &= children - 1) {
      const int i = __builtin_ctz(children);
      const Cell first = child_cell(pair.first, level, i);
      push(squared_gap(robot_, first, level - 1), {whole_robot, {}, pair.node.child(i), first});
    }
    return;
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const float squared = squared_gap(bounds_[i], pair.first, level);
    push(squared, {static_cast<std::int32_t>(i), {0, 1, false}, pair.node, pair.first});
  }
}

// What is larger is opened: a node, or those boxes that are larger than it.
void ClearanceSearch::expand_body(const Pair& pair) {
  const PlacedBody& body = bodies_[static_cast<std::size_t>(pair.body)];
  const PlacedCube cube = body.cube(pair.first, pair.node.level());
  const bool is_inner = pair.node.kind() == NodeCursor::Kind::inner;
  if (pair.of.triangles) return is_inner ? open_node(pair, cube) : measure_triangles(pair, cube);
  Pair smaller = pair, larger = pair;
  if (is_inner) larger.of.lanes &= body.body().boxes_larger_than(pair.of.index, cube.local.half);
  smaller.of.lanes &= ~larger.of.lanes;
  if (smaller.of.lanes) open_node(smaller, cube);
  if (larger.of.lanes) open_boxes(larger, cube);
}

void ClearanceSearch::open_node(const Pair& pair, const PlacedCube& cube) {
  PlacedBody& body = bodies_[static_cast<std::size_t>(pair.body)];
  const unsigned children = counting_children(pair.node);
  NearLanes near[8];
  body.near_octants(pair.of, cube, children, body_limit(body), near);
  for (unsigned rest = children; rest; rest &= rest - 1) {
    const int i = __builtin_ctz(rest);
    if (near[i].lanes == 0) continue;
    Pair child{pair.body, pair.of, pair.node.child(i), child_cell(pair.first, pair.node.level(), i)};
    child.of.lanes = near[i].lanes;
    push(near[i].least * body.scale_of_squares(), child);
  }
}

// Opens the boxes that are not much farther than the nearest of them, and queues the others as what they now are.
void ClearanceSearch::open_boxes(Pair pair, const PlacedCube& cube) {
  PlacedBody& body = bodies_[static_cast<std::size_t>(pair.body)];
  const float limit = body_limit(body);
  const NearLanes all = body.near_cube(pair.of, cube, limit);
  // By some part of the distance too: to one far away an edge adds nothing in float32, and no box would be opened.
  const float much_farther = 1.001f * std::sqrt(all.least) + cube.local.half, squared = much_farther * much_farther;
  std::uint32_t lanes = all.lanes;
  if (squared < limit) {
    lanes = body.near_cube(pair.of, cube, squared).lanes;
    pair.of.lanes = all.lanes & ~lanes;
    if (pair.of.lanes) push(squared * body.scale_of_squares(), pair);
  }
  for (; lanes; lanes &= lanes - 1) {
    Pair opened = pair;
    opened.of = body.body().opened(pair.of.index, __builtin_ctz(lanes));
    const NearLanes near = body.near_cube(opened.of, cube, limit);
    opened.of.lanes = near.lanes;
    if (near.lanes) push(near.least * body.scale_of_squares(), opened);
  }
}

void ClearanceSearch::measure_triangles(const Pair& pair, const PlacedCube& cube) {
  PlacedBody& body = bodies_[static_cast<std::size_t>(pair.body)];
  BoxesOrTriangles rest = pair.of;
  for (rest.lanes = body.near_cube(rest, cube, body_limit(body)).lanes; rest.lanes;) {
    const auto lane = static_cast<std::uint32_t>(__builtin_ctz(rest.lanes));
    rest.lanes &= rest.lanes - 1;
    if (!body.lower_to_triangle(rest.index, lane, cube, nearest_)) continue;
    squared_limit_ = static_cast<float>(nearest_.distance * nearest_.distance);
    rest.lanes = body.near_cube(rest, cube, body_limit(body)).lanes;
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
  if (node.kind() == NodeCursor::Kind::inner) return true;
  if (node.kind() == NodeCursor::Kind::unknown) return options_.unknown_is_occupied;
  return node.log_odds() >= options_.occupied_log_odds;
}

unsigned ClearanceSearch::counting_children(const NodeCursor& node) const {
  const unsigned occupied = node.children_at_least(options_.occupied_log_odds);
  return options_.unknown_is_occupied ? occupied | node.children_with_unknown() : occupied;
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

// Bounds that the kernels give of a body need not be looked at from this on.
float ClearanceSearch::body_limit(const PlacedBody& body) const { return squared_limit_ / body.scale_of_squares(); }

}  // namespace rayvox
