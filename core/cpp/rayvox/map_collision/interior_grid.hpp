#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rayvox/collision/solid.hpp"

namespace rayvox {

/// Where the inside of a mesh's closed parts is, known beforehand: a grid over them whose cells are inside, outside or
/// on the surface, and how many cells each is from the next inside. Immutable.
class InteriorGrid {
 public:
  /// `solid` is of `mesh`. About 64 cells along the longest side.
  InteriorGrid(const CollisionMesh& mesh, const Solid& solid);

  /// Whether a point at least `clear_m` from the surface of all closed parts may lie inside one, if it is within
  /// `radius_m` of p along each axis of the mesh. Points are relative to the mesh's centre.
  bool may_hold_inside(const Vec3d& p, double radius_m, double clear_m) const;

  enum class Side : std::uint8_t { outside, inside, undecided };
  /// Of a point at least `clear_m` from the surface of all closed parts.
  Side side(const Vec3d& p, double clear_m) const;

 private:
  static constexpr std::uint8_t surface = 0x80, steps = 0x7f;  // a cell: on the surface; steps to the next inside

  using Index = std::array<int, 3>;
  std::size_t at(const Index& i) const {
    return static_cast<std::size_t>(i[0]) +
           static_cast<std::size_t>(size_[0]) *
               (static_cast<std::size_t>(i[1]) + static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(i[2]));
  }
  Vec3d centre_of(const Index& i) const;
  Index nearest_cell(const Vec3d& p) const;
  bool holds_surface(double clear_m) const { return clear_m <= cell_diagonal_m_; }

  void mark_surface(const CollisionMesh& mesh);
  void mark_inside(const Solid& solid);
  void fill(const Index& seed, std::uint8_t value);
  void spread_steps();

  Vec3d low_;
  double cell_m_ = 0, cells_per_m_ = 0, cell_diagonal_m_ = 0;
  Index size_{};
  std::vector<std::uint8_t> cells_;
};

}  // namespace rayvox
