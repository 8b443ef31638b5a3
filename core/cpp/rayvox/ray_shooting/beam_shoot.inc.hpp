// Which cells does a scan pass? Asked from the cell's side: a cell is passed if a ray whose direction pierces it ends
// beyond it. Whole vectors of cells are tested against the bins of direction first (beam_cells.inc.hpp); what they
// leave undecided is tested ray by ray in float32 with an error bound, and exactly where that is not enough. Included
// once per instruction set, inside its namespace, after its Lanes and beam_cells.inc.hpp.

static inline std::uint32_t later(std::uint32_t at, int by, std::uint32_t end) {
  const std::uint32_t next = at + static_cast<std::uint32_t>(by);
  return next < end ? next : end;
}

// The lowest `count` bits, at most `most`.
static inline unsigned first_bits(std::uint32_t count, int most) {
  return (1u << (count < static_cast<std::uint32_t>(most) ? static_cast<int>(count) : most)) - 1;
}

// A box as rays of one face pierce it, a lane per ray: float32 crossings that err by less than `slack`.
template <class L>
struct PiercedBox {
  using F = typename L::Float;
  using M = typename L::Mask;
  struct Span {
    F enter, leave;  // depths; no ray passes where it leaves before it enters
    M delicate;      // may lie in a plane of the box's border: only exact arithmetic tells
  };
  F near, far, u0, u1, v0, v1, slack;
  bool on_u_plane, on_v_plane;

  explicit PiercedBox(const SeenBox& box)
      : near(L::broadcast(box.near > 0 ? box.near : 0)),
        far(L::broadcast(box.far)),
        u0(L::broadcast(box.u[0])),
        u1(L::broadcast(box.u[1])),
        v0(L::broadcast(box.v[0])),
        v1(L::broadcast(box.v[1])),
        slack(L::broadcast(box.far * beam_margin)),
        on_u_plane(box.u[0] == 0 || box.u[1] == 0),
        on_v_plane(box.v[0] == 0 || box.v[1] == 0) {}

  Span span_of(F inverse_u, F inverse_v) const {
    const F cross_u0 = L::multiply(u0, inverse_u), cross_u1 = L::multiply(u1, inverse_u);
    const F cross_v0 = L::multiply(v0, inverse_v), cross_v1 = L::multiply(v1, inverse_v);
    M delicate = L::from_bits(0);
    if (on_u_plane) delicate = L::either(delicate, L::less_equal(L::broadcast(1 / beam_flat), L::absolute(inverse_u)));
    if (on_v_plane) delicate = L::either(delicate, L::less_equal(L::broadcast(1 / beam_flat), L::absolute(inverse_v)));
    return {L::max(near, L::max(L::min(cross_u0, cross_u1), L::min(cross_v0, cross_v1))),
            L::min(far, L::min(L::max(cross_u0, cross_u1), L::max(cross_v0, cross_v1))), delicate};
  }
  // Rays that certainly pass nothing of the box, unless they are delicate.
  M missed_by(const Span& span, F depth) const {
    return L::either(L::less_equal(L::add(span.leave, slack), span.enter),
                     L::less_equal(L::add(depth, slack), span.enter));
  }
};

// Whether any ray of the face passes the cell, ray by ray; rows of bins have few rays, so two share a wide vector.
template <class L>
static bool any_ray_passes(const BeamScan& scan, const BeamFace& face, const SeenBox& box, const BinRect& bins,
                           const std::int32_t cell[3]) {
  using F = typename L::Float;
  using M = typename L::Mask;
  const auto [u, v] = bins;
  const PiercedBox<L> pierced(box);
  const F slack = pierced.slack;
  constexpr int rows = L::rows_at_once, share = L::width / rows;
  for (std::int32_t row = v.first; row <= v.last; row += rows) {
    const std::uint32_t* starts = face.bin_start + static_cast<std::size_t>(row) * face.columns;
    const std::uint32_t* second = starts + (rows == 2 && row < v.last ? face.columns : 0);
    std::uint32_t at[2] = {starts[u.first], second[u.first]}, end[2] = {starts[u.last + 1], second[u.last + 1]};
    if (second == starts) at[1] = end[1];
    for (; at[0] < end[0] || at[1] < end[1]; at[0] = later(at[0], share, end[0]), at[1] = later(at[1], share, end[1])) {
      F inverse_u, inverse_v, depth;
      L::load_columns(&scan.rays[at[0]].inverse_u, &scan.rays[at[1]].inverse_u, inverse_u, inverse_v, depth);
      const auto span = pierced.span_of(inverse_u, inverse_v);
      const M here =
          L::from_bits(first_bits(end[0] - at[0], share) | first_bits(end[1] - at[1], share) << (rows - 1) * share);
      const M pierces = L::less_equal(L::add(span.enter, slack), span.leave);
      const M beyond = L::less_equal(L::add(span.leave, slack), depth);
      if (L::any(L::both(here, L::both(L::both(pierces, beyond), L::invert(span.delicate))))) return true;
      const M misses = pierced.missed_by(span, depth);
      const M ends_inside =
          L::both(L::less_equal(L::add(span.enter, slack), depth), L::less_equal(L::add(depth, slack), span.leave));
      unsigned doubtful = L::bits(L::both(here, L::either(span.delicate, L::invert(L::either(misses, ends_inside)))));
      for (; doubtful; doubtful &= doubtful - 1) {
        const int lane = __builtin_ctz(doubtful), of_row = lane / share;
        if (passes_cell(scan, scan.rays[at[of_row] + static_cast<unsigned>(lane % share)].ray, cell)) return true;
      }
    }
  }
  return false;
}

// Of the wanted cells of an octant, those that whole vectors of cells show to be passed; `open` gets those left
// undecided.
template <class L>
static std::uint64_t passed_by_bins(const BeamScan& scan, SeenOctant& octant, std::uint64_t wanted,
                                    std::uint64_t& open) {
  std::uint64_t passed = 0;
  open = 0;
  for (int first = 0; first < 64; first += L::width) {
    const unsigned here = static_cast<unsigned>(wanted >> first) & L::all_bits;
    if (!here) continue;
    const SeenCells<L> cells(octant, first);
    unsigned yes = L::bits(cells.passed_by_bin(L::from_bits(here)));
    unsigned left = here & ~yes;
    if (left) left &= ~L::bits(cells.unreached(L::from_bits(left), octant, first));
    if (left) yes |= L::bits(cells.passed_by_deepest(scan, L::from_bits(left), 0.5f, 0.5f));
    left &= ~yes;
    passed |= static_cast<std::uint64_t>(yes) << first;
    open |= static_cast<std::uint64_t>(left) << first;
  }
  return passed;
}

// Those of the open cells of an octant that some ray of the face passes, cell by cell.
template <class L>
static std::uint64_t passed_by_rays(const BeamScan& scan, const SeenOctant& octant, const std::int32_t octant_cell[3],
                                    std::uint64_t open) {
  std::uint64_t passed = 0;
  for (; open; open &= open - 1) {
    const int index = __builtin_ctzll(open);
    std::int32_t cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] = octant_cell[axis] + static_cast<std::int32_t>(octant_places.along[axis][index]);
    }
    const SeenBox box = octant.cell(index);
    if (any_ray_passes<L>(scan, octant.face, box, octant.bins_of_cell(index, box), cell)) {
      passed |= std::uint64_t{1} << index;
    }
  }
  return passed;
}

// The wanted cells of an aligned 8x8x8 brick that some ray passes.
template <class L>
static void shoot_brick(const BeamScan& scan, const std::int32_t brick_cell[3], const std::uint64_t wanted[8],
                        std::uint64_t passed[8]) {
  for (int octant = 0; octant < 8; ++octant) passed[octant] = 0;
  const CellBlock brick{{brick_cell[0], brick_cell[1], brick_cell[2]}, 3};
  for (int f = 0; f < scan.face_count; ++f) {
    const BeamFace& face = scan.face[f];
    if (!face_reaches(face, see_block(scan, face, brick)) && !holds_origin(scan, brick)) continue;
    for (int octant = 0; octant < 8; ++octant) {
      const std::uint64_t left = wanted[octant] & ~passed[octant];
      if (!left) continue;
      CellBlock block{{}, 2};
      for (int axis = 0; axis < 3; ++axis) block.cell[axis] = brick_cell[axis] + 4 * (octant >> axis & 1);
      if (!face_reaches(face, see_block(scan, face, block))) continue;
      SeenOctant seen(scan, face, block);
      std::uint64_t open;
      passed[octant] |= passed_by_bins<L>(scan, seen, left, open);
      passed[octant] |= passed_by_rays<L>(scan, seen, block.cell, open);
    }
  }
}
