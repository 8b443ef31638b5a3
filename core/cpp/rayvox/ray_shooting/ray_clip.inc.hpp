// Rays clipped to an aligned block of cells: where each enters it and how many borders it crosses until it has left it
// or is in its end's cell. Float64 with an error bound; clip_exactly decides what is closer. Included once per
// instruction set, inside its namespace,
// after its WideLanes and beam_view.inc.hpp.

static constexpr double clip_t_margin = 1 + 0x1p-48;
static constexpr double clip_cell_margin = 0x1p-24;  // coordinates stay below 2^21: positions are off by under 2^-28

static inline std::uint32_t spread_six_bits(std::uint32_t bits) {
  bits = (bits | bits << 8) & 0x0300f;
  bits = (bits | bits << 4) & 0x030c3;
  return (bits | bits << 2) & 0x09249;
}

// One axis of rays and block, a lane per ray.
template <class W>
struct AxisClip {
  using F = typename W::Float;
  using M = typename W::Mask;
  F origin, direction, low, last, t_in, t_out, end_cell;
  M misses, up;

  AxisClip(const BeamScan& scan, const CellBlock& block, int axis, const Segment* rays) {
    const double start = scan.origin_cell[axis], first_cell = block.cell[axis],
                 beyond = first_cell + (1 << block.level);
    const F zero = W::broadcast(0.0), infinity = W::broadcast(__builtin_inf()),
            end = W::gather(scan.end[axis], &rays->ray);
    origin = W::broadcast(scan.origin[axis]);
    low = W::broadcast(first_cell);
    last = W::broadcast(beyond - 1);
    direction = W::subtract(end, origin);
    end_cell = W::floor(end);
    up = W::less_than(zero, direction);
    const F per_voxel = W::divide(W::broadcast(1.0), direction);
    const F to_low = W::multiply(W::broadcast(first_cell - scan.origin[axis]), per_voxel);
    const F to_high = W::multiply(W::broadcast(beyond - scan.origin[axis]), per_voxel);
    const M ends_below = W::less_than(end_cell, low), ends_above = W::less_than(last, end_cell);
    t_in = start < first_cell ? to_low : start >= beyond ? to_high : W::broadcast(-1.0);  // -1: from the start
    t_out = W::select(ends_above, to_high, W::select(ends_below, to_low, infinity));
    misses = start < first_cell ? ends_below : start >= beyond ? ends_above : W::from_bits(0);
  }

  // Position at parameter t: its cell, and whether that is too close to a border to tell.
  F cell_at(F t, M& near_border) const {
    const F position = W::add(origin, W::multiply(t, direction)), cell = W::floor(position);
    const F off = W::subtract(position, cell), margin = W::broadcast(clip_cell_margin);
    near_border = W::either(W::less_than(off, margin), W::less_than(W::broadcast(1 - clip_cell_margin), off));
    return W::min(W::max(cell, low), last);
  }
};

// Calls visit(box, first, last) with runs of sorted rays, all that can enter the block among them, and the block as
// their face sees it. Bins in which no ray reaches the block are left out where they begin or end a vector of them.
template <class L, class Visit>
static inline void for_reaching_rays(const BeamScan& scan, const CellBlock& block, const Visit& visit) {
  for (int f = 0; f < scan.face_count; ++f) {
    const BeamFace& face = scan.face[f];
    const SeenBox box = see_block(scan, face, block);
    const auto [u, v] = bins_of(face, box);
    const PiercedBox<L> pierced(box);
    const auto near = L::multiply(pierced.near, L::broadcast(1 - beam_margin));
    for (std::int32_t row = v.first; row <= v.last; ++row) {
      const std::size_t bins = static_cast<std::size_t>(row) * static_cast<std::size_t>(face.columns);
      const float* farthest = face.farthest + face.level_start[0] + bins;
      for (std::int32_t column = u.first; column <= u.last; column += L::width) {
        const auto here = L::first_lanes(static_cast<std::uint32_t>(u.last + 1 - column));
        const unsigned reaching = L::bits(L::both(here, L::less_than(near, L::load(farthest + column))));
        if (!reaching) continue;
        const std::uint32_t* starts = face.bin_start + bins + column;
        visit(pierced, starts[__builtin_ctz(reaching)], starts[32 - __builtin_clz(reaching)]);
      }
    }
  }
}

// How many rays may have to be looked at for the block.
template <class L>
static std::size_t count_rays_towards(const BeamScan& scan, const CellBlock& block) {
  std::size_t count = 0;
  for_reaching_rays<L>(scan, block,
                       [&](const PiercedBox<L>&, std::uint32_t first, std::uint32_t last) { count += last - first; });
  return count;
}

// The rays that may pass cells of the block, as segments of which only the ray is set; idle lanes of clip_to_block get
// the scan's first.
template <class L>
static std::size_t find_rays_towards(const BeamScan& scan, const CellBlock& block, Segment* out) {
  using F = typename L::Float;
  std::size_t found = 0;
  for_reaching_rays<L>(scan, block, [&](const PiercedBox<L>& pierced, std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t at = first; at < last; at += L::width) {
      F inverse_u, inverse_v, depth;
      const BeamRay* rays = scan.rays + at;
      L::load_columns(&rays->inverse_u, &rays[L::width / 2].inverse_u, inverse_u, inverse_v, depth);
      const auto span = pierced.span_of(inverse_u, inverse_v);
      const auto may_pass = L::either(span.delicate, L::invert(pierced.missed_by(span, depth)));
      for (unsigned left = L::bits(L::both(may_pass, L::first_lanes(last - at))); left; left &= left - 1) {
        out[found++].ray = rays[__builtin_ctz(left)].ray;
      }
    }
  });
  for (int lane = 0; lane < L::width; ++lane) out[found + static_cast<std::size_t>(lane)].ray = 0;
  return found;
}

// Clips such rays to the block, in place: leaves a segment for each that passes a cell of it, returns how many.
template <class W>
static std::size_t clip_to_block(const BeamScan& scan, const CellBlock& block, Segment* segments, std::size_t count) {
  using F = typename W::Float;
  using M = typename W::Mask;
  const F zero = W::broadcast(0.0), one = W::broadcast(1.0), margin = W::broadcast(clip_t_margin);
  const M starts_outside = W::from_bits(holds_origin(scan, block) ? 0 : ~0u);
  std::size_t made = 0;
  for (std::size_t at = 0; at < count; at += W::width) {
    const AxisClip<W> axes[3] = {
        {scan, block, 0, segments + at}, {scan, block, 1, segments + at}, {scan, block, 2, segments + at}};
    const F t_in = W::max(axes[0].t_in, W::max(axes[1].t_in, axes[2].t_in));
    const F t_out = W::min(axes[0].t_out, W::min(axes[1].t_out, axes[2].t_out));
    const M misses = W::either(W::either(axes[0].misses, axes[1].misses),
                               W::either(axes[2].misses, W::less_than(W::multiply(t_out, margin), t_in)));
    const std::size_t left = count - at;
    const unsigned here = left < W::width ? (1u << left) - 1 : (1u << W::width) - 1;
    const unsigned enters = here & ~W::bits(misses);
    if (!enters) continue;
    M doubtful = W::invert(W::less_than(W::multiply(t_in, margin), t_out));
    const M ends_inside = W::equal(t_out, W::broadcast(__builtin_inf()));
    alignas(64) std::int32_t entered[3][W::width], crossings[W::width];
    F crossed = zero;
    M some_in = W::from_bits(0), some_out = W::from_bits(0);
    for (int axis = 0; axis < 3; ++axis) {
      const AxisClip<W>& a = axes[axis];
      M near_in, near_out;
      const F passing_in = a.cell_at(t_in, near_in), passing_out = a.cell_at(t_out, near_out);
      const M by_in = W::equal(a.t_in, t_in), by_out = W::equal(a.t_out, t_out);
      const M flat = W::equal(a.direction, zero);
      const F start = W::broadcast(scan.origin_cell[axis]);
      const F border_in = W::select(a.up, a.low, a.last);
      const F border_out = W::select(a.up, W::add(a.last, one), W::subtract(a.low, one));
      F in = W::select(starts_outside, W::select(by_in, border_in, passing_in), start);
      F to = W::select(ends_inside, a.end_cell, W::select(by_out, border_out, passing_out));
      in = W::select(flat, start, in);
      to = W::select(flat, start, to);
      // Two axes at the same time: which is first depends on their senses.
      doubtful = W::either(doubtful, W::both(starts_outside, W::both(by_in, some_in)));
      doubtful = W::either(doubtful, W::both(W::both(by_out, some_out), W::invert(ends_inside)));
      some_in = W::either(some_in, by_in);
      some_out = W::either(some_out, by_out);
      const M unclear_in = W::both(W::both(starts_outside, near_in), W::invert(W::either(by_in, flat)));
      const M unclear_out = W::both(near_out, W::invert(W::either(ends_inside, W::either(by_out, flat))));
      doubtful = W::either(doubtful, W::either(unclear_in, unclear_out));
      crossed = W::add(crossed, W::absolute(W::subtract(to, in)));
      W::store_int(entered[axis], W::subtract(in, a.low));
    }
    W::store_int(crossings, crossed);
    const unsigned doubts = W::bits(doubtful);
    for (unsigned open = enters; open; open &= open - 1) {
      const int lane = __builtin_ctz(open);
      Segment segment{segments[at + static_cast<std::size_t>(lane)].ray,
                      spread_six_bits(static_cast<std::uint32_t>(entered[0][lane])) |
                          spread_six_bits(static_cast<std::uint32_t>(entered[1][lane])) << 1 |
                          spread_six_bits(static_cast<std::uint32_t>(entered[2][lane])) << 2 |
                          static_cast<std::uint32_t>(crossings[lane]) << 18};
      if (doubts >> lane & 1) [[unlikely]] {
        if (!clip_exactly(scan, block, segment.ray, segment)) continue;
      }
      segments[made] = segment;  // never beyond this lane
      made += segment.start_and_crossings >> 18 ? 1 : 0;
    }
  }
  return made;
}
