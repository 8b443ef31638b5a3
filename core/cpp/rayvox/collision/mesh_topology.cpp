#include "rayvox/collision/mesh_topology.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace rayvox {
namespace {

using Kind = MeshComponent::Kind;

std::uint64_t hash_of(const Vec3d& p) {
  std::uint64_t h = 0;
  for (int axis = 0; axis < 3; ++axis) {
    // + 0.0 makes the two zeros one.
    h = (h ^ std::bit_cast<std::uint64_t>(p[axis] + 0.0)) * 0x9e3779b97f4a7c15u;
    h ^= h >> 29;
  }
  return h;
}

bool equal(const Vec3d& a, const Vec3d& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

// For each vertex the first at its position: open addressing, linear probing.
std::vector<std::uint32_t> first_at_position(const std::vector<Vec3d>& vertices) {
  const std::size_t slots = std::bit_ceil(2 * vertices.size() + 1);
  std::vector<std::uint32_t> table(slots, ~0u), first(vertices.size());
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    std::size_t slot = hash_of(vertices[v]) & (slots - 1);
    while (table[slot] != ~0u && !equal(vertices[table[slot]], vertices[v])) slot = (slot + 1) & (slots - 1);
    if (table[slot] == ~0u) table[slot] = v;
    first[v] = table[slot];
  }
  return first;
}

class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(std::uint32_t a, std::uint32_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::uint32_t> parent_;
};

struct DirectedEdge {
  std::uint64_t ends;  // lower vertex in the high half
  std::int32_t direction;
  std::uint32_t component;
};

std::vector<Kind> kinds_of(std::vector<DirectedEdge> edges, std::size_t components) {
  std::sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.ends < b.ends; });
  std::vector<Kind> kind(components, Kind::oriented);
  std::vector<bool> has_edges(components, false);
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t count = 0;
    std::int32_t balance = 0;
    const DirectedEdge& first = edges[i];
    for (; i < edges.size() && edges[i].ends == first.ends; ++i, ++count) balance += edges[i].direction;
    Kind& k = kind[first.component];
    k = std::min(k, balance == 0 ? Kind::oriented : count % 2 == 0 ? Kind::even : Kind::open);
    has_edges[first.component] = true;
  }
  for (std::size_t c = 0; c < components; ++c) {
    if (!has_edges[c]) kind[c] = Kind::open;
  }
  return kind;
}

void extend(MeshComponent& part, const Vec3d& p) {
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d& low = part.extreme[static_cast<std::size_t>(axis)];
    Vec3d& high = part.extreme[static_cast<std::size_t>(axis + 3)];
    if (p[axis] < low[axis]) low = p;
    if (p[axis] > high[axis]) high = p;
  }
}

}  // namespace

MeshTopology find_components(const std::vector<Vec3d>& vertices,
                             const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const std::vector<std::uint32_t> first = first_at_position(vertices);
  UnionFind parts(vertices.size());
  for (const auto& t : triangles) {
    parts.unite(first[t[0]], first[t[1]]);
    parts.unite(first[t[0]], first[t[2]]);
  }
  MeshTopology out;
  out.component_of.resize(triangles.size());
  std::vector<std::uint32_t> component_of_root(vertices.size(), ~0u);
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const std::array<std::uint32_t, 3> t{first[triangles[i][0]], first[triangles[i][1]], first[triangles[i][2]]};
    std::uint32_t& component = component_of_root[parts.find(t[0])];
    if (component == ~0u) {
      component = static_cast<std::uint32_t>(out.components.size());
      out.components.push_back({Kind::open, {}});
      out.components.back().extreme.fill(vertices[t[0]]);
    }
    out.component_of[i] = component;
    for (const std::uint32_t v : t) extend(out.components[component], vertices[v]);
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    for (int e = 0; e < 3; ++e) {
      const std::uint32_t from = t[static_cast<std::size_t>(e)], to = t[static_cast<std::size_t>((e + 1) % 3)];
      edges.push_back(
          {static_cast<std::uint64_t>(std::min(from, to)) << 32 | std::max(from, to), from < to ? 1 : -1, component});
    }
  }
  const std::vector<Kind> kinds = kinds_of(std::move(edges), out.components.size());
  for (std::size_t c = 0; c < kinds.size(); ++c) out.components[c].kind = kinds[c];
  return out;
}

}  // namespace rayvox
