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

// Whether any ray of the face passes the cell, ray by ray; rows of bins have few rays, so two share a wide vector.
template <class L>
static bool any_ray_passes(const BeamScan& scan, const BeamFace& face, const SeenBox& box, const std::int32_t cell[3]) {
  using F = typename L::Float;
  using M = typename L::Mask;
  const auto [u, v] = bins_of(face, box);
  const float margin = box.far * beam_margin;
  const F near = L::broadcast(box.near > 0 ? box.near : 0), far = L::broadcast(box.far), slack = L::broadcast(margin);
  const F u0 = L::broadcast(box.u[0]), u1 = L::broadcast(box.u[1]);
  const F v0 = L::broadcast(box.v[0]), v1 = L::broadcast(box.v[1]);
  const bool on_u_plane = box.u[0] == 0 || box.u[1] == 0, on_v_plane = box.v[0] == 0 || box.v[1] == 0;
  constexpr int rows = L::rows_at_once, share = L::width / rows;
  for (std::int32_t row = v.first; row <= v.last; row += rows) {
    const std::uint32_t* starts = face.bin_start + static_cast<std::size_t>(row) * face.columns;
    const std::uint32_t* second = starts + (rows == 2 && row < v.last ? face.columns : 0);
    std::uint32_t at[2] = {starts[u.first], second[u.first]}, end[2] = {starts[u.last + 1], second[u.last + 1]};
    if (second == starts) at[1] = end[1];
    for (; at[0] < end[0] || at[1] < end[1]; at[0] = later(at[0], share, end[0]), at[1] = later(at[1], share, end[1])) {
      F inverse_u, inverse_v, depth;
      L::load_columns(&scan.rays[at[0]].inverse_u, &scan.rays[at[1]].inverse_u, inverse_u, inverse_v, depth);
      const F cross_u0 = L::multiply(u0, inverse_u), cross_u1 = L::multiply(u1, inverse_u);
      const F cross_v0 = L::multiply(v0, inverse_v), cross_v1 = L::multiply(v1, inverse_v);
      const F enter = L::max(near, L::max(L::min(cross_u0, cross_u1), L::min(cross_v0, cross_v1)));
      const F leave = L::min(far, L::min(L::max(cross_u0, cross_u1), L::max(cross_v0, cross_v1)));
      const M here =
          L::from_bits(first_bits(end[0] - at[0], share) | first_bits(end[1] - at[1], share) << (rows - 1) * share);
      M delicate = L::from_bits(0);
      if (on_u_plane)
        delicate = L::either(delicate, L::less_equal(L::broadcast(1 / beam_flat), L::absolute(inverse_u)));
      if (on_v_plane)
        delicate = L::either(delicate, L::less_equal(L::broadcast(1 / beam_flat), L::absolute(inverse_v)));
      const M pierces = L::less_equal(L::add(enter, slack), leave), beyond = L::less_equal(L::add(leave, slack), depth);
      if (L::any(L::both(here, L::both(L::both(pierces, beyond), L::invert(delicate))))) return true;
      const M misses =
          L::either(L::less_equal(L::add(leave, slack), enter), L::less_equal(L::add(depth, slack), enter));
      const M ends_inside =
          L::both(L::less_equal(L::add(enter, slack), depth), L::less_equal(L::add(depth, slack), leave));
      unsigned doubtful = L::bits(L::both(here, L::either(delicate, L::invert(L::either(misses, ends_inside)))));
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
static std::uint64_t passed_by_bins(const BeamScan& scan, const BeamFace& face, const SeenBox& octant,
                                    std::uint64_t wanted, std::uint64_t& open) {
  std::uint64_t passed = 0;
  open = 0;
  for (int first = 0; first < 64; first += L::width) {
    const unsigned here = static_cast<unsigned>(wanted >> first) & L::all_bits;
    if (!here) continue;
    const SeenCells<L> cells(face, octant, first);
    unsigned yes = L::bits(cells.passed_by_bin(L::from_bits(here)));
    unsigned left = here & ~yes;
    if (left) left &= ~L::bits(cells.unreached(L::from_bits(left)));
    if (left) yes |= L::bits(cells.passed_by_deepest(scan, L::from_bits(left), 0.5f, 0.5f));
    left &= ~yes;
    passed |= static_cast<std::uint64_t>(yes) << first;
    open |= static_cast<std::uint64_t>(left) << first;
  }
  return passed;
}

// Those of the open cells of an octant that some ray of the face passes, cell by cell.
template <class L>
static std::uint64_t passed_by_rays(const BeamScan& scan, const BeamFace& face, const CellBlock& octant,
                                    std::uint64_t open) {
  std::uint64_t passed = 0;
  for (; open; open &= open - 1) {
    const int index = __builtin_ctzll(open);
    CellBlock cell{{}, 0};
    for (int axis = 0; axis < 3; ++axis) {
      cell.cell[axis] = octant.cell[axis] + ((index >> axis & 1) | (index >> (axis + 3) & 1) << 1);
    }
    if (any_ray_passes<L>(scan, face, see_block(scan, face, cell), cell.cell)) passed |= std::uint64_t{1} << index;
  }
  return passed;
}

// The wanted cells of an aligned 8x8x8 brick that some ray passes.
template <class L>
static void shoot_brick(const BeamScan& scan, const std::int32_t brick_cell[3], const std::uint64_t wanted[8],
                        std::uint64_t passed[8]) {
  for (int octant = 0; octant < 8; ++octant) {
    passed[octant] = 0;
    CellBlock block{{}, 2};
    for (int axis = 0; axis < 3; ++axis) block.cell[axis] = brick_cell[axis] + 4 * (octant >> axis & 1);
    for (int f = 0; f < scan.face_count; ++f) {
      const BeamFace& face = scan.face[f];
      const std::uint64_t left = wanted[octant] & ~passed[octant];
      if (!left) break;
      const SeenBox box = see_block(scan, face, block);
      if (!face_reaches(face, box)) continue;
      std::uint64_t open;
      passed[octant] |= passed_by_bins<L>(scan, face, box, left, open);
      passed[octant] |= passed_by_rays<L>(scan, face, block, open);
    }
  }
}
