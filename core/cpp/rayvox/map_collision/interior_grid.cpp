#include "rayvox/map_collision/interior_grid.hpp"

#include <algorithm>
#include <cmath>

#include "rayvox/map_collision/triangle_cube.hpp"

namespace rayvox {
namespace {

constexpr int cells_along_longest = 64;
// Cells reach a little over their neighbours, so that rounding of an index crosses no surface.
constexpr double overlap = 1 + 1e-6;

}  // namespace

InteriorGrid::InteriorGrid(const CollisionMesh& mesh, const Solid& solid) {
  if (!solid.exists()) return;
  const Vec3d extent = solid.high() - solid.low();
  const double longest = std::max({extent.x, extent.y, extent.z});
  if (longest <= 0) return;
  cell_m_ = longest / cells_along_longest;
  cells_per_m_ = 1 / cell_m_;
  cell_diagonal_m_ = cell_m_ * overlap * std::sqrt(3.0);
  // Around everything lie a layer of cells that are outside, and one that no point is looked up in.
  low_ = solid.low() - Vec3d{cell_m_, cell_m_, cell_m_} * 2.5;
  for (int c = 0; c < 3; ++c) size_[static_cast<std::size_t>(c)] = static_cast<int>(extent[c] * cells_per_m_) + 6;
  cells_.assign(at({0, 0, size_[2]}), steps);
  mark_surface(mesh);
  mark_inside(solid);
  spread_steps();
}

Vec3d InteriorGrid::centre_of(const Index& i) const {
  return low_ + Vec3d{i[0] + 0.5, i[1] + 0.5, i[2] + 0.5} * cell_m_;
}

InteriorGrid::Index InteriorGrid::nearest_cell(const Vec3d& p) const {
  Index i;
  for (int c = 0; c < 3; ++c) {
    const double last = size_[static_cast<std::size_t>(c)] - 2;
    i[static_cast<std::size_t>(c)] = static_cast<int>(std::min(std::max((p[c] - low_[c]) * cells_per_m_, 1.0), last));
  }
  return i;
}

bool InteriorGrid::may_hold_inside(const Vec3d& p, double radius_m, double clear_m) const {
  if (cells_.empty()) return false;
  if (holds_surface(clear_m)) return true;
  // From beyond the grid it is at least as far as from the cell nearest to it.
  return ((cells_[at(nearest_cell(p))] & steps) - 1) * cell_m_ <= radius_m * overlap;
}

InteriorGrid::Side InteriorGrid::side(const Vec3d& p, double clear_m) const {
  if (cells_.empty()) return Side::outside;
  const std::uint8_t cell = cells_[at(nearest_cell(p))];
  if (cell & surface) return holds_surface(clear_m) ? Side::undecided : Side::outside;
  return cell == 0 ? Side::inside : Side::outside;
}

void InteriorGrid::mark_surface(const CollisionMesh& mesh) {
  const double half = 0.5 * cell_m_ * overlap;
  const Vec3d reach{half, half, half};
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    if (mesh.components()[mesh.component_of(t)].kind == MeshComponent::Kind::open) continue;
    const Triangle triangle = mesh.triangle(t);
    Vec3d low = triangle[0], high = triangle[0];
    for (const Vec3d& p : triangle) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const Index from = nearest_cell(low - reach), to = nearest_cell(high + reach);
    Index i;
    for (i[2] = from[2]; i[2] <= to[2]; ++i[2]) {
      for (i[1] = from[1]; i[1] <= to[1]; ++i[1]) {
        for (i[0] = from[0]; i[0] <= to[0]; ++i[0]) {
          const Vec3d centre = centre_of(i);
          const Triangle around{triangle[0] - centre, triangle[1] - centre, triangle[2] - centre};
          if (!(cells_[at(i)] & surface) && triangle_meets_cube(around, half)) cells_[at(i)] |= surface;
        }
      }
    }
  }
}

// No surface lies between neighbours that hold none: what is true of one is true of all that it reaches.
void InteriorGrid::mark_inside(const Solid& solid) {
  constexpr std::uint8_t outside_reached = steps - 1;
  fill({0, 0, 0}, outside_reached);
  Index i;
  for (i[2] = 0; i[2] < size_[2]; ++i[2]) {
    for (i[1] = 0; i[1] < size_[1]; ++i[1]) {
      for (i[0] = 0; i[0] < size_[0]; ++i[0]) {
        if (cells_[at(i)] == steps) fill(i, solid.contains(centre_of(i)) ? std::uint8_t{0} : outside_reached);
      }
    }
  }
}

void InteriorGrid::fill(const Index& seed, std::uint8_t value) {
  std::vector<Index> waiting{seed};
  cells_[at(seed)] = value;
  while (!waiting.empty()) {
    const Index i = waiting.back();
    waiting.pop_back();
    for (std::size_t c = 0; c < 3; ++c) {
      for (const int step : {-1, 1}) {
        Index next = i;
        next[c] += step;
        if (next[c] < 0 || next[c] >= size_[c] || cells_[at(next)] != steps) continue;
        cells_[at(next)] = value;
        waiting.push_back(next);
      }
    }
  }
}

// Steps to neighbours of all 26 kinds: the largest of a difference's coordinates. One sweep forward over the thirteen
// neighbours that come before a cell, one backward over the others.
void InteriorGrid::spread_steps() {
  std::vector<std::uint8_t> to_inside(cells_.size());
  for (std::size_t n = 0; n < cells_.size(); ++n) to_inside[n] = cells_[n] == 0 ? 0 : steps;
  std::ptrdiff_t before[13];
  const auto line = static_cast<std::ptrdiff_t>(size_[0]), layer = line * size_[1];
  for (int n = 0; n < 13; ++n) before[n] = (n % 3 - 1) + line * (n / 3 % 3 - 1) + layer * (n / 9 - 1);
  const auto sweep = [&](int direction) {
    for (int z = 1; z < size_[2] - 1; ++z) {
      for (int y = 1; y < size_[1] - 1; ++y) {
        for (int x = 1; x < size_[0] - 1; ++x) {
          const std::size_t first = at({x, y, z}), here = direction > 0 ? first : cells_.size() - 1 - first;
          int least = to_inside[here] - 1;
          for (const std::ptrdiff_t step : before) {
            least = std::min<int>(least, to_inside[here + static_cast<std::size_t>(direction * step)]);
          }
          to_inside[here] = static_cast<std::uint8_t>(least + 1);
        }
      }
    }
  };
  sweep(1);
  sweep(-1);
  for (std::size_t n = 0; n < cells_.size(); ++n) {
    cells_[n] = static_cast<std::uint8_t>((cells_[n] & surface) | to_inside[n]);
  }
}

}  // namespace rayvox
