#include "rayvox/geometry/triangle_tree.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "rayvox/error.hpp"
#include "rayvox/geometry/mesh_parts.hpp"
#include "rayvox/geometry/triangle_distance.hpp"

namespace rayvox {
namespace {

constexpr std::size_t leaf_triangles = 4;
// A median split halves the triangles: 2^31 of them make 31 levels, each leaves one node behind on the way down.
constexpr std::size_t stack_nodes = 64;

double squared_distance_to_box(const Vec3d& low, const Vec3d& high, const Vec3d& p) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double gap = std::max({low[axis] - p[axis], 0.0, p[axis] - high[axis]});
    sum += gap * gap;
  }
  return sum;
}

// The slabs of the box grown by `margin`, which contains all within that distance of it.
bool segment_meets_box(const Vec3d& low, const Vec3d& high, double margin, const Vec3d& from, const Vec3d& to) {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = to[axis] - from[axis], lower = low[axis] - margin, upper = high[axis] + margin;
    if (d == 0) {
      if (from[axis] < lower || from[axis] > upper) return false;
      continue;
    }
    const double a = (lower - from[axis]) / d, b = (upper - from[axis]) / d;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  // Rounding of the two quotients must not lose a touch.
  return enter <= leave + 1e-12;
}

std::pair<Vec3d, Vec3d> bounds_of(const Triangle& t) {
  Vec3d low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = std::min({t[0][axis], t[1][axis], t[2][axis]});
    high[axis] = std::max({t[0][axis], t[1][axis], t[2][axis]});
  }
  return {low, high};
}

// Whether the line along +x through p crosses the edge's projection above p, by the half-open rule: of the edges of a
// closed part an even number does. The edge is put into one order first, so that its triangles agree to the last bit.
bool crosses_above(Vec3d a, Vec3d b, const Vec3d& p) {
  if ((a.y > p.y) == (b.y > p.y)) return false;
  if (a.y > b.y) std::swap(a, b);
  return (p.y - a.y) * (b.z - a.z) > (p.z - a.z) * (b.y - a.y);
}

bool crosses_in_front(const Triangle& t, const Vec3d& p) {
  if (!(crosses_above(t[0], t[1], p) ^ crosses_above(t[1], t[2], p) ^ crosses_above(t[2], t[0], p))) return false;
  const Vec3d u = t[1] - t[0], v = t[2] - t[0], w = p - t[0];
  const double nx = u.y * v.z - u.z * v.y, ny = u.z * v.x - u.x * v.z, nz = u.x * v.y - u.y * v.x;
  const double side = nx * w.x + ny * w.y + nz * w.z;
  return nx > 0 ? side < 0 : side > 0;
}

}  // namespace

TriangleTree::TriangleTree(const TriangleMeshView& mesh) {
  const MeshParts parts = find_parts(mesh);
  if (mesh.triangle_count() == 0) throw InvalidInput("a mesh without triangles");
  build(mesh);
  closed_part_.resize(index_of_.size());
  slot_of_.resize(index_of_.size());
  for (std::size_t slot = 0; slot < index_of_.size(); ++slot) {
    const std::int32_t part = parts.part[index_of_[slot]];
    closed_part_[slot] = part != MeshParts::none && parts.closed[static_cast<std::size_t>(part)] ? part : -1;
    slot_of_[index_of_[slot]] = static_cast<std::uint32_t>(slot);
  }
}

void TriangleTree::build(const TriangleMeshView& mesh) {
  const std::size_t count = mesh.triangle_count();
  std::vector<Vec3d> centres(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Triangle t = mesh.triangle(i);
    centres[i] = (t[0] + t[1] + t[2]) * (1.0 / 3.0);
  }
  index_of_.resize(count);
  std::iota(index_of_.begin(), index_of_.end(), 0);
  nodes_.reserve(count);
  nodes_.emplace_back();
  emit_node(index_of_, 0, count, centres, mesh, 0);
  triangles_.reserve(count);
  for (const std::uint32_t i : index_of_) triangles_.push_back(mesh.triangle(i));
}

void TriangleTree::emit_node(std::vector<std::uint32_t>& order, std::size_t first, std::size_t last,
                             const std::vector<Vec3d>& centres, const TriangleMeshView& mesh, std::size_t node) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Vec3d low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity}, from = low, to = high;
  for (std::size_t i = first; i < last; ++i) {
    const Triangle t = mesh.triangle(order[i]);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min({low[axis], t[0][axis], t[1][axis], t[2][axis]});
      high[axis] = std::max({high[axis], t[0][axis], t[1][axis], t[2][axis]});
      from[axis] = std::min(from[axis], centres[order[i]][axis]);
      to[axis] = std::max(to[axis], centres[order[i]][axis]);
    }
  }
  nodes_[node].low = low;
  nodes_[node].high = high;
  if (last - first <= leaf_triangles) {
    nodes_[node].first = static_cast<std::uint32_t>(first);
    nodes_[node].count = static_cast<std::uint32_t>(last - first);
    return;
  }
  const Vec3d spread = to - from;
  const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
  const std::size_t middle = first + (last - first) / 2;
  const auto at = [&](std::size_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(last),
                   [&](std::uint32_t a, std::uint32_t b) { return centres[a][axis] < centres[b][axis]; });
  const std::size_t child = nodes_.size();
  nodes_.resize(child + 2);
  nodes_[node].first = static_cast<std::uint32_t>(child);
  emit_node(order, first, middle, centres, mesh, child);
  emit_node(order, middle, last, centres, mesh, child + 1);
}

TriangleTree::Nearest TriangleTree::nearest(const Vec3d& p, double within) const {
  struct Entry {
    std::uint32_t node;
    double squared;
  };
  Entry stack[stack_nodes];
  std::size_t depth = 0;
  double best = within * within;
  Nearest found;
  stack[depth++] = {0, squared_distance_to_box(nodes_[0].low, nodes_[0].high, p)};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.squared >= best) continue;
    const Node& node = nodes_[entry.node];
    for (std::uint32_t slot = node.first; slot < node.first + node.count; ++slot) {
      const double squared = squared_distance(triangles_[slot], p);
      if (squared < best) {
        best = squared;
        found = {std::sqrt(squared), index_of_[slot]};
      }
    }
    if (node.count > 0) continue;
    const Node &left = nodes_[node.first], &right = nodes_[node.first + 1];
    Entry near{node.first, squared_distance_to_box(left.low, left.high, p)};
    Entry far{node.first + 1, squared_distance_to_box(right.low, right.high, p)};
    if (far.squared < near.squared) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
  return found;
}

template <class Enter, class Accept>
bool TriangleTree::any_triangle(const Enter& enter, const Accept& accept) const {
  std::uint32_t stack[stack_nodes];
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (!enter(node.low, node.high)) continue;
    for (std::uint32_t slot = node.first; slot < node.first + node.count; ++slot) {
      if (accept(slot)) return true;
    }
    if (node.count > 0) continue;
    stack[depth++] = node.first + 1;
    stack[depth++] = node.first;
  }
  return false;
}

bool TriangleTree::touches(const Vec3d& p, double distance) const {
  const double squared = distance * distance;
  return any_triangle(
      [&](const Vec3d& low, const Vec3d& high) { return squared_distance_to_box(low, high, p) <= squared; },
      [&](std::uint32_t slot) { return squared_distance(triangles_[slot], p) <= squared; });
}

bool TriangleTree::touches(const Vec3d& from, const Vec3d& to, double distance) const {
  const double squared = distance * distance;
  const auto near = [&](const Vec3d& low, const Vec3d& high) {
    return segment_meets_box(low, high, distance, from, to);
  };
  return any_triangle(near, [&](std::uint32_t slot) {
    const auto [low, high] = bounds_of(triangles_[slot]);
    return near(low, high) && squared_distance(triangles_[slot], from, to) <= squared;
  });
}

bool TriangleTree::inside(const Vec3d& p) const {
  std::vector<std::int32_t> crossed;
  const auto in_front = [&](const Vec3d& low, const Vec3d& high) {
    return high.x >= p.x && low.y <= p.y && high.y >= p.y && low.z <= p.z && high.z >= p.z;
  };
  any_triangle(in_front, [&](std::uint32_t slot) {
    if (closed_part_[slot] >= 0 && crosses_in_front(triangles_[slot], p)) crossed.push_back(closed_part_[slot]);
    return false;
  });
  std::sort(crossed.begin(), crossed.end());
  for (auto at = crossed.begin(); at != crossed.end();) {
    const auto end = std::upper_bound(at, crossed.end(), *at);
    if ((end - at) % 2 != 0) return true;
    at = end;
  }
  return false;
}

}  // namespace rayvox
