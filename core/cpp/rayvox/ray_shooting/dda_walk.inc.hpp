// The exact DDA (Amanatides and Woo 1987) over a tile's segments, Lanes::width rays in lockstep. Included once per
// instruction set, inside its namespace, after its Lanes.
//
// Each lane measures its ray in dominant-axis voxels from the segment's first crossing, so parameters stay below 64 and float32
// knows them to 2^-16.6. They are computed from the number of crossings, never accumulated. Crossings closer than
// near_tie are left to exact arithmetic (crossing_order.hpp); that is one lane-step in some ten thousand.

constexpr float near_tie = 0x1p-15f;
constexpr std::uint32_t x_bits = 0x09249, y_bits = x_bits << 1, z_bits = x_bits << 2;

static std::uint32_t compact(std::uint32_t code) {
  std::uint32_t value = 0;
  for (int bit = 0; bit < 6; ++bit) value |= (code >> (3 * bit) & 1) << bit;
  return value;
}

// One lane's ray, in the form the loop needs. Morton coordinates are stepped in place: with the other axes' bits
// masked away, subtracting the lowest bit steps down, subtracting the mask (adding its two's complement) steps up.
template <class L>
struct LaneStart {
  alignas(64) float t_first[3][L::width];
  alignas(64) float t_step[3][L::width];
  alignas(64) std::uint32_t position[3][L::width];
  alignas(64) std::uint32_t decrement[3][L::width];
  alignas(64) std::uint32_t remaining[L::width];

  void clear(int lane) {
    for (int axis = 0; axis < 3; ++axis) {
      t_first[axis][lane] = t_step[axis][lane] = 0;
      position[axis][lane] = decrement[axis][lane] = 0;
    }
    remaining[lane] = 0;
  }

  void set(int lane, const TileSegments& tile, const Segment& segment) {
    constexpr std::uint32_t bits[3] = {x_bits, y_bits, z_bits};
    constexpr float never = __builtin_inff();
    double direction[3], longest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      direction[axis] = tile.end[axis][segment.ray] - tile.origin[axis];
      longest = __builtin_fmax(longest, __builtin_fabs(direction[axis]));
    }
    const std::uint32_t first_cell = segment.start_and_crossings & 0x3ffff;
    double t[3], base = __builtin_inf();
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = tile.tile_cell[axis] + static_cast<double>(compact(first_cell >> axis));
      const double border = cell + (direction[axis] > 0 ? 1 : 0);
      const double per_voxel = longest / direction[axis];
      t[axis] = direction[axis] != 0 ? (border - tile.origin[axis]) * per_voxel : __builtin_inf();
      base = __builtin_fmin(base, t[axis]);
      t_step[axis][lane] =
          direction[axis] != 0 ? static_cast<float>(__builtin_fmin(__builtin_fabs(per_voxel), 1e30)) : 0.0f;
      position[axis][lane] = first_cell & bits[axis];
      decrement[axis][lane] = direction[axis] > 0 ? bits[axis] : (1u << axis);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double ahead = t[axis] - base;
      t_first[axis][lane] = ahead < 1e30 ? static_cast<float>(ahead) : never;
    }
    remaining[lane] = segment.start_and_crossings >> 18;
  }
};

// Decides the near-ties of one step exactly; `axes` comes in as the lanes' candidates and goes out as the axes that step.
// Returns, per lane, how many axes step beyond the first.
template <class L>
static void settle_near_ties(const TileSegments& tile, const Segment* segments, unsigned lanes,
                             const std::uint32_t (*position)[L::width], unsigned axes[3], std::uint32_t* extra) {
  for (; lanes; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
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

template <class L>
static void walk_segments(const TileSegments& tile, TileMarks& marks) {
  using F = typename L::Float;
  using U = typename L::Uint;
  using M = typename L::Mask;
  constexpr int width = L::width;
  const U masks[3] = {L::broadcast(x_bits), L::broadcast(y_bits), L::broadcast(z_bits)};
  const U idle = L::broadcast(static_cast<std::uint32_t>(tile_cells));
  LaneStart<L> start;

  for (std::size_t first = 0; first < tile.count; first += width) {
    const Segment* segments = tile.segments + first;
    for (int lane = 0; lane < width; ++lane) {
      if (first + static_cast<std::size_t>(lane) < tile.count) {
        start.set(lane, tile, segments[lane]);
      } else {
        start.clear(lane);
      }
    }
    F t[3], t_first[3], t_step[3], crossed[3];
    U position[3], decrement[3];
    for (int axis = 0; axis < 3; ++axis) {
      t[axis] = t_first[axis] = L::load(start.t_first[axis]);
      t_step[axis] = L::load(start.t_step[axis]);
      position[axis] = L::load(start.position[axis]);
      decrement[axis] = L::load(start.decrement[axis]);
      crossed[axis] = L::broadcast(0.0f);
    }
    U remaining = L::load(start.remaining);
    U last_brick = L::broadcast(0xffffffffu);

    for (M active = L::nonzero(remaining); L::any(active); active = L::nonzero(remaining)) {
      // Mark the cell each lane is in, and its brick where that is new.
      const U cell = L::combine(position[0], position[1], position[2]);
      const U brick = L::brick_of(cell);
      L::mark(marks.cell, L::select(active, cell, idle));
      L::mark_where(marks.brick, brick, L::both(active, L::differ(brick, last_brick)));
      last_brick = brick;

      // Step the axis whose border is met first.
      const F limit = L::add(L::min(t[0], L::min(t[1], t[2])), L::broadcast(near_tie));
      M axes[3];
      for (int axis = 0; axis < 3; ++axis) axes[axis] = L::less_equal(t[axis], limit);
      remaining = L::decrement_where(remaining, active);
      const M tied = L::both(active, L::either(L::both(axes[0], axes[1]), L::both(axes[2], L::either(axes[0], axes[1]))));
      if (L::any(tied)) [[unlikely]] {
        alignas(64) std::uint32_t at[3][width], extra[width] = {};
        unsigned bits[3];
        for (int axis = 0; axis < 3; ++axis) {
          L::store(at[axis], position[axis]);
          bits[axis] = L::bits(axes[axis]);
        }
        settle_near_ties<L>(tile, segments, L::bits(tied), at, bits, extra);
        for (int axis = 0; axis < 3; ++axis) axes[axis] = L::from_bits(bits[axis]);
        remaining = L::subtract(remaining, L::load(extra));
      }
      for (int axis = 0; axis < 3; ++axis) {
        position[axis] = L::dilated_step(position[axis], decrement[axis], masks[axis], axes[axis]);
        crossed[axis] = L::increment_where(crossed[axis], axes[axis]);
        t[axis] = L::multiply_add(crossed[axis], t_step[axis], t_first[axis]);
      }
    }
  }
}
