// The exact DDA (Amanatides and Woo 1987) over a tile's segments, Lanes::width rays in lockstep. Included once per
// instruction set, inside its namespace, after its Lanes.
//
// Each lane measures its ray in dominant-axis voxels from the segment's first crossing. A parameter is computed from
// the number of crossings, never accumulated: first + count * step, three float32 roundings (2^-24 each) at most, so
// two parameters whose order is in doubt lie within a factor of 1 + 2^-21 of each other. Those are left to exact
// arithmetic (crossing_order.hpp), one lane-step in some fifty thousand. The absolute part covers the float64
// arithmetic that the first crossings come from.

constexpr float tie_factor = 1 + 0x1p-21f;
constexpr float tie_margin = 0x1p-24f;
constexpr std::uint32_t axis_bits[3] = {0x09249, 0x09249 << 1, 0x09249 << 2};

// Every third bit of an 18-bit Morton code, from bit 0.
static inline std::uint32_t compact(std::uint32_t code) {
  code &= axis_bits[0];
  code = (code | code >> 2) & 0x030c3;
  code = (code | code >> 4) & 0x0300f;
  return (code | code >> 8) & 0x0003f;
}

// Lanes::width segments walked together. Morton coordinates are stepped in place: with the other axes' bits masked
// away, subtracting the lowest bit steps down, subtracting the mask (adding its two's complement) steps up.
template <class L>
class LockstepRays {
 public:
  static constexpr int width = L::width;
  using F = typename L::Float;
  using U = typename L::Uint;
  using M = typename L::Mask;

  // Lanes beyond `count` stay idle.
  LockstepRays(const TileSegments& tile, const Segment* segments, int count) : tile_(tile), segments_(segments) {
    alignas(64) float first[3][width], step[3][width];
    alignas(64) std::uint32_t position[3][width], decrement[3][width], remaining[width];
    alignas(64) double direction[3][width], longest[width], ahead[3][width], base[width];
    for (int lane = 0; lane < width; ++lane) {
      const Segment& segment = segments[lane < count ? lane : 0];
      const std::uint32_t cell = segment.start_and_crossings & 0x3ffff;
      remaining[lane] = lane < count ? segment.start_and_crossings >> 18 : 0;
      for (int axis = 0; axis < 3; ++axis) {
        direction[axis][lane] = tile.end[axis][segment.ray] - tile.origin[axis];
        position[axis][lane] = cell & axis_bits[axis];
      }
    }
    for (int lane = 0; lane < width; ++lane) {
      const double x = __builtin_fabs(direction[0][lane]), y = __builtin_fabs(direction[1][lane]);
      const double z = __builtin_fabs(direction[2][lane]), xy = x > y ? x : y;
      longest[lane] = xy > z ? xy : z;
      base[lane] = __builtin_inf();
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (int lane = 0; lane < width; ++lane) {
        const double d = direction[axis][lane];
        const double cell = tile.tile_cell[axis] + static_cast<double>(compact(position[axis][lane] >> axis));
        const double per_voxel = longest[lane] / d;
        const double t = (cell + (d > 0 ? 1 : 0) - tile.origin[axis]) * per_voxel;
        ahead[axis][lane] = d != 0 ? t : __builtin_inf();
        base[lane] = ahead[axis][lane] < base[lane] ? ahead[axis][lane] : base[lane];
        const double magnitude = __builtin_fabs(per_voxel);
        step[axis][lane] = static_cast<float>(magnitude < 1e30 ? magnitude : 1e30);
        decrement[axis][lane] = d > 0 ? axis_bits[axis] : (1u << axis);
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (int lane = 0; lane < width; ++lane) {
        const double t = ahead[axis][lane] - base[lane];
        first[axis][lane] = t < 1e30 ? static_cast<float>(t) : __builtin_inff();
      }
      t_[axis] = t_first_[axis] = L::load(first[axis]);
      t_step_[axis] = L::load(step[axis]);
      position_[axis] = L::load(position[axis]);
      decrement_[axis] = L::load(decrement[axis]);
      crossed_[axis] = L::broadcast(0.0f);
    }
    remaining_ = L::load(remaining);
  }

  bool active() const { return L::any(L::nonzero(remaining_)); }

  // Marks the cell each active lane is in, then steps it over the border that is met first.
  void mark_and_step(TileMarks& marks) {
    const M active = L::nonzero(remaining_);
    const U cell = L::combine(position_[0], position_[1], position_[2]);
    L::mark(marks.cell, L::select(active, cell, L::broadcast(static_cast<std::uint32_t>(tile_cells))));
    remaining_ = L::decrement_where(remaining_, active);

    const F first = L::min(t_[0], L::min(t_[1], t_[2]));
    const F limit = L::multiply_add(first, L::broadcast(tie_factor), L::broadcast(tie_margin));
    M axes[3];
    for (int axis = 0; axis < 3; ++axis) axes[axis] = L::less_equal(t_[axis], limit);
    const M two = L::either(L::both(axes[0], axes[1]), L::both(axes[2], L::either(axes[0], axes[1])));
    if (L::any(L::both(active, two))) [[unlikely]] {
      settle_near_ties(L::bits(L::both(active, two)), axes);
    }
    for (int axis = 0; axis < 3; ++axis) {
      position_[axis] = L::dilated_step(position_[axis], decrement_[axis], L::broadcast(axis_bits[axis]), axes[axis]);
      crossed_[axis] = L::increment_where(crossed_[axis], axes[axis]);
      t_[axis] = L::multiply_add(crossed_[axis], t_step_[axis], t_first_[axis]);
    }
  }

 private:
  // Decides exactly which axes the tied lanes step; `axes` comes in as their candidates.
  __attribute__((noinline)) void settle_near_ties(unsigned tied, M axes[3]) {
    alignas(64) std::uint32_t position[3][width], extra[width] = {};
    unsigned bits[3];
    for (int axis = 0; axis < 3; ++axis) {
      L::store(position[axis], position_[axis]);
      bits[axis] = L::bits(axes[axis]);
    }
    for (; tied; tied &= tied - 1) {
      const int lane = __builtin_ctz(tied);
      std::int32_t cell[3];
      std::uint8_t candidates = 0;
      for (int axis = 0; axis < 3; ++axis) {
        cell[axis] = tile_.tile_cell[axis] + static_cast<std::int32_t>(compact(position[axis][lane] >> axis));
        candidates |= static_cast<std::uint8_t>((bits[axis] >> lane & 1) << axis);
      }
      const std::uint8_t together = settle_tie(tile_, segments_[lane].ray, cell, candidates);
      for (int axis = 0; axis < 3; ++axis) {
        bits[axis] = (bits[axis] & ~(1u << lane)) | static_cast<unsigned>(together >> axis & 1) << lane;
      }
      extra[lane] = static_cast<std::uint32_t>(__builtin_popcount(together)) - 1;
    }
    for (int axis = 0; axis < 3; ++axis) axes[axis] = L::from_bits(bits[axis]);
    remaining_ = L::subtract(remaining_, L::load(extra));
  }

  const TileSegments& tile_;
  const Segment* segments_;
  F t_[3], t_first_[3], t_step_[3], crossed_[3];
  U position_[3], decrement_[3], remaining_;
};

template <class L>
static void walk_segments(const TileSegments& tile, TileMarks& marks) {
  // Two groups at a time: a step is one long chain of dependent instructions, two chains fill the pipeline.
  constexpr std::size_t width = L::width;
  for (std::size_t first = 0; first < tile.count; first += 2 * width) {
    const std::size_t count = tile.count - first;
    const Segment* segments = tile.segments + first;
    LockstepRays<L> a(tile, segments, static_cast<int>(count < width ? count : width));
    const std::size_t second = count > width ? count - width : 0;
    LockstepRays<L> b(tile, segments + (second ? width : 0), static_cast<int>(second < width ? second : width));
    while (a.active() && b.active()) {
      a.mark_and_step(marks);
      b.mark_and_step(marks);
    }
    while (a.active()) a.mark_and_step(marks);
    while (b.active()) b.mark_and_step(marks);
  }
}
