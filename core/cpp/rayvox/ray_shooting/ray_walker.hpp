#pragma once
#include "rayvox/ray_shooting/ray.hpp"

namespace rayvox {

/// Walks the cells of a ray exactly, one at a time or in strides of aligned 2^level blocks (Amanatides and Woo 1987,
/// with every crossing computed from the border itself, never accumulated, and near-ties decided by compare_crossings).
class RayWalker {
 public:
  explicit RayWalker(const Ray& ray);

  const Cell& cell() const { return cell_; }
  const Cell& end_cell() const { return end_cell_; }
  /// Ray parameter in [0, 1] at which cell() was entered, to float64 rounding.
  double t() const {
    return crossed_axis_ < 0 ? 0
                             : (crossed_border_ - ray_.origin[crossed_axis_]) /
                                   (ray_.end[crossed_axis_] - ray_.origin[crossed_axis_]);
  }
  /// True once the end lies in the current 2^level block.
  bool end_in_block(int level) const {
    return ((cell_[0] ^ end_cell_[0]) >> level | (cell_[1] ^ end_cell_[1]) >> level |
            (cell_[2] ^ end_cell_[2]) >> level) == 0;
  }
  /// Moves to the first cell outside the current aligned 2^level block. Requires !end_in_block(level).
  void leave_block(int level);
  /// Moves on to the first cell inside the block of 2^level cells a side that starts at `first`; false, with cell() of
  /// no meaning, if the ray does not pass the block from here on.
  bool enter_block(const Cell& first, int level);

 private:
  std::int32_t cell_after_crossing(int axis, std::int32_t border) const {
    return ray_.end[axis] > ray_.origin[axis] ? border : border - 1;
  }
  std::int32_t cell_at_crossing(int axis, double t, int crossed_axis, double crossed_border) const;

  Ray ray_;
  Cell cell_, end_cell_;
  double inverse_[3];      // of end - origin; of no meaning where no border is crossed
  int crossed_axis_ = -1;  // last border crossed, none yet
  double crossed_border_ = 0;
};

}  // namespace rayvox
