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

// What lanes need to know of their segments before the first step, laid out so that compilers vectorise its making.
template <int width>
struct LaneStart {
  alignas(64) float t_first[3][width], t_step[3][width];
  alignas(64) std::uint32_t position[3][width], decrement[3][width], remaining[width];

  // Lanes beyond `count` stay idle.
  LaneStart(const TileSegments& tile, const Segment* segments, int count) {
    alignas(64) double direction[3][width], t[3][width], longest[width], base[width];
    alignas(64) std::uint32_t first_cell[width];
    for (int lane = 0; lane < width; ++lane) {
      const Segment& segment = segments[lane < count ? lane : 0];
      first_cell[lane] = segment.start_and_crossings & 0x3ffff;
      remaining[lane] = lane < count ? segment.start_and_crossings >> 18 : 0;
      for (int axis = 0; axis < 3; ++axis) {
        direction[axis][lane] = tile.end[axis][segment.ray] - tile.origin[axis];
      }
    }
    for (int lane = 0; lane < width; ++lane) {
      const double x = __builtin_fabs(direction[0][lane]), y = __builtin_fabs(direction[1][lane]);
      const double z = __builtin_fabs(direction[2][lane]), xy = x > y ? x : y;
      longest[lane] = xy > z ? xy : z;
      base[lane] = __builtin_inf();
    }
    for (int axis = 0; axis < 3; ++axis) {
      // Copies, which the compiler knows nobody else writes.
      const std::uint32_t bits = axis_bits[axis], lowest_bit = 1u << axis;
      const double tile_cell = tile.tile_cell[axis], origin = tile.origin[axis];
      for (int lane = 0; lane < width; ++lane) {
        const double d = direction[axis][lane];
        const double cell =
            tile_cell + static_cast<double>(static_cast<std::int32_t>(compact(first_cell[lane] >> axis)));
        const double per_voxel = longest[lane] / d;
        const double met = (cell + (d > 0 ? 1.0 : 0.0) - origin) * per_voxel;
        t[axis][lane] = d != 0 ? met : __builtin_inf();
        base[lane] = t[axis][lane] < base[lane] ? t[axis][lane] : base[lane];
        const double magnitude = __builtin_fabs(per_voxel);
        t_step[axis][lane] = static_cast<float>(magnitude < 1e30 ? magnitude : 1e30);
        position[axis][lane] = first_cell[lane] & bits;
        decrement[axis][lane] = d > 0 ? bits : lowest_bit;
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (int lane = 0; lane < width; ++lane) {
        const double ahead = t[axis][lane] - base[lane];
        t_first[axis][lane] = ahead < 1e30 ? static_cast<float>(ahead) : __builtin_inff();
      }
    }
  }
};

// Decides exactly which axes the tied lanes step. `axes` (a bit per lane) comes in as their candidates; `extra` counts,
// per lane, the axes that step beyond the first.
template <int width>
__attribute__((noinline)) static void settle_near_ties(const TileSegments& tile, const Segment* segments, unsigned tied,
                                                       const std::uint32_t (&position)[3][width], unsigned (&axes)[3],
                                                       std::uint32_t (&extra)[width]) {
  for (; tied; tied &= tied - 1) {
    const int lane = __builtin_ctz(tied);
    std::int32_t cell[3];
    std::uint8_t candidates = 0;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] = tile.tile_cell[axis] + static_cast<std::int32_t>(compact(position[axis][lane] >> axis));
      candidates |= static_cast<std::uint8_t>((axes[axis] >> lane & 1) << axis);
    }
    const std::uint8_t together = settle_tie(tile, segments[lane].ray, cell, candidates);
    for (int axis = 0; axis < 3; ++axis) {
      axes[axis] = (axes[axis] & ~(1u << lane)) | static_cast<unsigned>(together >> axis & 1) << lane;
    }
    extra[lane] = static_cast<std::uint32_t>(__builtin_popcount(together)) - 1;
  }
}

// Lanes::width segments walked together. Morton coordinates are stepped in place: with the other axes' bits masked
// away, subtracting the lowest bit steps down, subtracting the mask (adding its two's complement) steps up. Nothing
// takes this object's address, so that all of it stays in registers.
template <class L>
struct LockstepRays {
  using F = typename L::Float;
  using U = typename L::Uint;
  using M = typename L::Mask;
  static constexpr int width = L::width;

  F tx, ty, tz, tx_first, ty_first, tz_first, tx_step, ty_step, tz_step, x_crossed, y_crossed, z_crossed;
  U x, y, z, x_decrement, y_decrement, z_decrement, remaining;

  explicit LockstepRays(const LaneStart<width>& start)
      : tx(L::load(start.t_first[0])),
        ty(L::load(start.t_first[1])),
        tz(L::load(start.t_first[2])),
        tx_first(tx),
        ty_first(ty),
        tz_first(tz),
        tx_step(L::load(start.t_step[0])),
        ty_step(L::load(start.t_step[1])),
        tz_step(L::load(start.t_step[2])),
        x_crossed(L::broadcast(0.0f)),
        y_crossed(x_crossed),
        z_crossed(x_crossed),
        x(L::load(start.position[0])),
        y(L::load(start.position[1])),
        z(L::load(start.position[2])),
        x_decrement(L::load(start.decrement[0])),
        y_decrement(L::load(start.decrement[1])),
        z_decrement(L::load(start.decrement[2])),
        remaining(L::load(start.remaining)) {}

  bool active() const { return L::any(L::nonzero(remaining)); }

  // Marks the cell each active lane is in, then steps it over the border that is met first.
  void mark_and_step(const TileSegments& tile, const Segment* segments, TileMarks& marks) {
    const M walking = L::nonzero(remaining);
    L::mark(marks.cell, L::select(walking, L::combine(x, y, z), L::broadcast(static_cast<std::uint32_t>(tile_cells))));
    remaining = L::decrement_where(remaining, walking);

    const F first = L::min(tx, L::min(ty, tz));
    const F limit = L::multiply_add(first, L::broadcast(tie_factor), L::broadcast(tie_margin));
    M in_x = L::less_equal(tx, limit), in_y = L::less_equal(ty, limit), in_z = L::less_equal(tz, limit);
    const M tied = L::both(walking, L::either(L::both(in_x, in_y), L::both(in_z, L::either(in_x, in_y))));
    if (L::any(tied)) [[unlikely]] {
      alignas(64) std::uint32_t position[3][width], extra[width] = {};
      L::store(position[0], x);
      L::store(position[1], y);
      L::store(position[2], z);
      unsigned axes[3] = {L::bits(in_x), L::bits(in_y), L::bits(in_z)};
      settle_near_ties<width>(tile, segments, L::bits(tied), position, axes, extra);
      in_x = L::from_bits(axes[0]);
      in_y = L::from_bits(axes[1]);
      in_z = L::from_bits(axes[2]);
      remaining = L::subtract(remaining, L::load(extra));
    }
    x = L::dilated_step(x, x_decrement, L::broadcast(axis_bits[0]), in_x);
    y = L::dilated_step(y, y_decrement, L::broadcast(axis_bits[1]), in_y);
    z = L::dilated_step(z, z_decrement, L::broadcast(axis_bits[2]), in_z);
    x_crossed = L::increment_where(x_crossed, in_x);
    y_crossed = L::increment_where(y_crossed, in_y);
    z_crossed = L::increment_where(z_crossed, in_z);
    tx = L::multiply_add(x_crossed, tx_step, tx_first);
    ty = L::multiply_add(y_crossed, ty_step, ty_first);
    tz = L::multiply_add(z_crossed, tz_step, tz_first);
  }
};

template <class L>
static void walk_segments(const TileSegments& tile, TileMarks& marks) {
  constexpr int width = L::width;
  for (std::size_t first = 0; first < tile.count; first += width) {
    const std::size_t count = tile.count - first;
    const Segment* segments = tile.segments + first;
    LockstepRays<L> rays(LaneStart<width>(tile, segments, static_cast<int>(count < width ? count : width)));
    while (rays.active()) rays.mark_and_step(tile, segments, marks);
  }
}
