#include "rayvox/robot/surface_deviation.hpp"

#include <algorithm>
#include <atomic>
#include <limits>
#include <vector>

#include "rayvox/error.hpp"
#include "rayvox/geometry/triangle_distance.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t triangles_per_task = 256, vertices_per_task = 1024;
constexpr int most_divisions = 14;
constexpr double beyond = 1 + 1e-9;
constexpr double loose_of_limit = 0.1, loose_of_itself = 0.05;
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Corner {
  Vec3d point;
  TriangleTree::Nearest nearest;
};

struct Piece {
  Corner corners[3];
  int divisions;
};

void raise(std::atomic<double>& maximum, double value) {
  double seen = maximum.load(std::memory_order_relaxed);
  while (seen < value && !maximum.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

double least_distance(const Piece& piece) {
  return std::max(
      {piece.corners[0].nearest.distance, piece.corners[1].nearest.distance, piece.corners[2].nearest.distance});
}

// The largest corner distance to the one simplified triangle for which it is smallest, or, since the distance changes
// by no more than the way gone: the nearest corner's, plus the way to the other two.
double upper_bound_of(const Piece& piece, const TriangleTree& simplified) {
  double bound = infinity;
  for (const Corner& candidate : piece.corners) {
    const Triangle& triangle = simplified.triangle(candidate.nearest.triangle);
    double squared = 0, way = 0;
    for (const Corner& corner : piece.corners) {
      squared = std::max(squared, squared_distance(triangle, corner.point));
      way = std::max(way, norm(corner.point - candidate.point));
    }
    bound = std::min({bound, std::sqrt(squared), candidate.nearest.distance + way});
  }
  return bound;
}

class Search {
 public:
  Search(const TriangleTree& simplified, double limit) : simplified_(simplified), limit_(limit) {}

  Corner corner(const Vec3d& p) {
    // Beyond the limit the search is over, so nothing farther need be looked for.
    const Corner found{p, simplified_.nearest(p, limit_ * beyond)};
    raise(least_, found.nearest.distance);
    return found;
  }

  void cover(const Corner& a, const Corner& b, const Corner& c) {
    std::vector<Piece> open{{{a, b, c}, 0}};
    while (!open.empty() && least_.load(std::memory_order_relaxed) <= limit_) {
      const Piece piece = open.back();
      open.pop_back();
      if (least_distance(piece) > limit_) return;
      const double bound = upper_bound_of(piece, simplified_);
      const double tolerated = std::max((1 + loose_of_itself) * least_.load(std::memory_order_relaxed),
                                        least_distance(piece) + loose_of_limit * limit_);
      if (bound <= std::min(tolerated, limit_) || piece.divisions == most_divisions) {
        raise(most_, bound);
      } else {
        divide(piece, open);
      }
    }
  }

  double result() const { return std::max(least_.load(), most_.load()) <= limit_ ? most_.load() : infinity; }

 private:
  void divide(const Piece& piece, std::vector<Piece>& open) {
    const auto& [a, b, c] = piece.corners;
    const Corner ab = corner((a.point + b.point) * 0.5), bc = corner((b.point + c.point) * 0.5),
                 ca = corner((c.point + a.point) * 0.5);
    const int divisions = piece.divisions + 1;
    open.push_back({{a, ab, ca}, divisions});
    open.push_back({{ab, b, bc}, divisions});
    open.push_back({{ca, bc, c}, divisions});
    open.push_back({{ab, bc, ca}, divisions});
  }

  const TriangleTree& simplified_;
  const double limit_;
  std::atomic<double> least_{0}, most_{0};
};

}  // namespace

double surface_deviation(const TriangleMeshView& original, const TriangleTree& simplified, double limit_m) {
  require_valid(original);
  if (!(limit_m > 0) || !std::isfinite(limit_m)) throw InvalidInput("limit_m is not a finite number above zero");
  Search search(simplified, limit_m);
  std::vector<Corner> corners(original.vertex_count());
  parallel_for((corners.size() + vertices_per_task - 1) / vertices_per_task, [&](std::size_t task, int) {
    const std::size_t end = std::min(corners.size(), (task + 1) * vertices_per_task);
    for (std::size_t i = task * vertices_per_task; i < end; ++i) corners[i] = search.corner(original.vertex(i));
  });
  const std::size_t count = original.triangle_count();
  parallel_for((count + triangles_per_task - 1) / triangles_per_task, [&](std::size_t task, int) {
    const std::size_t end = std::min(count, (task + 1) * triangles_per_task);
    for (std::size_t i = task * triangles_per_task; i < end; ++i) {
      const auto at = [&](std::size_t k) { return corners[static_cast<std::size_t>(original.triangles[3 * i + k])]; };
      search.cover(at(0), at(1), at(2));
    }
  });
  return search.result();
}

}  // namespace rayvox
