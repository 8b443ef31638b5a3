#include "rayvox/geometry/mesh_parts.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

namespace rayvox {
namespace {

using Index = std::uint32_t;

struct Edge {
  Index low, high, triangle;

  bool same_place(const Edge& other) const { return low == other.low && high == other.high; }
  auto key() const { return std::tie(low, high, triangle); }
};

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  Index find(Index i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(Index a, Index b) { parent_[find(a)] = find(b); }

 private:
  std::vector<Index> parent_;
};

// Triangles over places, corners ascending, without degenerate and repeated ones; the last entry is the triangle.
std::vector<std::array<Index, 4>> distinct_triangles(const TriangleMeshView& mesh) {
  const std::vector<std::int32_t> place = weld_vertices(mesh.vertices);
  std::vector<std::array<Index, 4>> all;
  all.reserve(mesh.triangle_count());
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    std::array<Index, 4> corners{};
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = static_cast<Index>(place[static_cast<std::size_t>(mesh.triangles[3 * t + k])]);
    std::sort(corners.begin(), corners.begin() + 3);
    corners[3] = static_cast<Index>(t);
    if (corners[0] != corners[1] && corners[1] != corners[2]) all.push_back(corners);
  }
  std::sort(all.begin(), all.end());
  const auto same = [](const auto& a, const auto& b) { return std::equal(a.begin(), a.begin() + 3, b.begin()); };
  all.erase(std::unique(all.begin(), all.end(), same), all.end());
  return all;
}

std::vector<Edge> edges_of(const std::vector<std::array<Index, 4>>& triangles) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const auto& [a, b, c, triangle] : triangles) {
    edges.insert(edges.end(), {{a, b, triangle}, {b, c, triangle}, {a, c, triangle}});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.key() < b.key(); });
  return edges;
}

// Calls visit(first, last) for each range of edges at the same place.
template <class Visit>
void for_each_place(const std::vector<Edge>& edges, Visit visit) {
  for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
    while (last < edges.size() && edges[last].same_place(edges[first])) ++last;
    visit(first, last);
  }
}

}  // namespace

std::vector<std::int32_t> weld_vertices(std::span<const double> vertices) {
  std::vector<std::size_t> order(vertices.size() / 3);
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](std::size_t i) {
    return std::make_tuple(vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]);
  };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  std::vector<std::int32_t> place(order.size());
  std::int32_t next = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && key(order[i - 1]) < key(order[i])) ++next;
    place[order[i]] = next;
  }
  return place;
}

MeshParts find_parts(const TriangleMeshView& mesh) {
  require_valid(mesh);
  const std::vector<std::array<Index, 4>> triangles = distinct_triangles(mesh);
  const std::vector<Edge> edges = edges_of(triangles);

  // Bodies that touch along an edge stay apart, and so does a fin from the body that it stands on.
  DisjointSets sets(mesh.triangle_count());
  for_each_place(edges, [&](std::size_t first, std::size_t last) {
    if (last - first == 2) sets.unite(edges[first].triangle, edges[first + 1].triangle);
  });

  MeshParts parts{std::vector<std::int32_t>(mesh.triangle_count(), MeshParts::none), {}};
  std::vector<std::int32_t> part_of_root(mesh.triangle_count(), MeshParts::none);
  for (const auto& corners : triangles) {
    std::int32_t& part = part_of_root[sets.find(corners[3])];
    if (part == MeshParts::none) {
      part = static_cast<std::int32_t>(parts.closed.size());
      parts.closed.push_back(1);
    }
    parts.part[corners[3]] = part;
  }

  std::vector<std::int32_t> here;
  for_each_place(edges, [&](std::size_t first, std::size_t last) {
    here.clear();
    for (std::size_t i = first; i < last; ++i) here.push_back(parts.part[edges[i].triangle]);
    std::sort(here.begin(), here.end());
    for (auto at = here.begin(); at != here.end();) {
      const auto end = std::upper_bound(at, here.end(), *at);
      if ((end - at) % 2 != 0) parts.closed[static_cast<std::size_t>(*at)] = 0;
      at = end;
    }
  });
  return parts;
}

}  // namespace rayvox
