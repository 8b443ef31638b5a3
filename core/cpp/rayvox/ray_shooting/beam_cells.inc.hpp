// Tests of whole vectors of cells against the bins of direction: certain answers only. Included once per instruction
// set, inside its namespace, after its Lanes and beam_view.inc.hpp.

// Where an octant's 64 cells lie along each axis, in Morton order.
struct OctantPlaces {
  alignas(64) std::uint32_t along[3][64];
  constexpr OctantPlaces() : along() {
    for (unsigned cell = 0; cell < 64; ++cell) {
      for (unsigned axis = 0; axis < 3; ++axis) along[axis][cell] = (cell >> axis & 1) | (cell >> (axis + 3) & 1) << 1;
    }
  }
};
static constexpr OctantPlaces octant_places;

// An octant seen through one face: the borders between its cells, each rounded once from its exact place, and for its
// cells the bins that their directions can lie in, where SeenCells found them.
struct SeenOctant {
  const BeamFace& face;
  float depth[12], u[12], v[12];  // five; more may be read, not used
  alignas(64) std::uint32_t first_column[64], last_column[64], first_row[64], last_row[64];

  SeenOctant(const BeamScan& scan, const BeamFace& f, const CellBlock& block) : face(f) {
    for (int i = 0; i < 12; ++i) {
      const auto border = [&](std::int32_t axis) {
        return static_cast<float>(block.cell[axis] + (i < 4 ? i : 4) - scan.origin[axis]);
      };
      depth[i] = border(f.axis);
      u[i] = border(f.u_axis);
      v[i] = border(f.v_axis);
    }
  }

  // Of a cell, by its place in the octant; as see_block.
  SeenBox cell(int index) const {
    const std::uint32_t at = octant_places.along[face.axis][index], at_u = octant_places.along[face.u_axis][index],
                        at_v = octant_places.along[face.v_axis][index];
    const bool up = face.sign > 0;
    return {up ? depth[at] : -depth[at + 1],
            up ? depth[at + 1] : -depth[at],
            {u[at_u], u[at_u + 1]},
            {v[at_v], v[at_v + 1]}};
  }
  BinRect bins_of_cell(int index, const SeenBox& box) const {
    if (!(least_near <= box.near)) return bins_of(face, box);
    return {{static_cast<std::int32_t>(first_column[index]), static_cast<std::int32_t>(last_column[index])},
            {static_cast<std::int32_t>(first_row[index]), static_cast<std::int32_t>(last_row[index])}};
  }
  // Nearer cells are not tested by bins in vectors.
  static constexpr float least_near = 0.5f;
};

// Lanes::width cells of an octant from the `first` on.
template <class L>
struct SeenCells {
  using F = typename L::Float;
  using U = typename L::Uint;
  using M = typename L::Mask;

  const BeamFace& face;
  F near, far, u0, u1, v0, v1, per_near;
  M ahead;  // lanes far enough from the origin for the tests by bins

  SeenCells(const SeenOctant& octant, int first) : face(octant.face) {
    const U along = L::load(octant_places.along[face.axis] + first);
    const U along_u = L::load(octant_places.along[face.u_axis] + first);
    const U along_v = L::load(octant_places.along[face.v_axis] + first);
    const F low = L::lookup8(octant.depth, along), high = L::lookup8(octant.depth + 1, along);
    const F zero = L::broadcast(0.0f);
    near = face.sign > 0 ? low : L::subtract(zero, high);
    far = face.sign > 0 ? high : L::subtract(zero, low);
    u0 = L::lookup8(octant.u, along_u);
    u1 = L::lookup8(octant.u + 1, along_u);
    v0 = L::lookup8(octant.v, along_v);
    v1 = L::lookup8(octant.v + 1, along_v);
    per_near = L::divide(L::broadcast(1.0f), near);
    ahead = L::less_equal(L::broadcast(SeenOctant::least_near), near);
  }

  // A bin that lies wholly in the front face, at the level at which that is two to four bins wide, holds a ray that
  // ends beyond the cell: all its rays pierce the cell.
  M passed_by_bin(M asked) const {
    const F zero = L::broadcast(0.0f), one = L::broadcast(1.0f), margin = L::broadcast(beam_bin_margin);
    const U level = L::level_of(L::multiply(per_near, L::broadcast(face.bins_per_unit)), -1, face.levels - 1);
    const F scale = L::multiply(L::broadcast(face.bins_per_unit), L::power_of_half(level)),
            grow = L::power_of_two(level);
    const F u_low = L::broadcast(face.u_low), v_low = L::broadcast(face.v_low);
    const F left = L::multiply(L::subtract(L::multiply(u0, per_near), u_low), scale);
    const F right = L::multiply(L::subtract(L::multiply(u1, per_near), u_low), scale);
    const F top = L::multiply(L::subtract(L::multiply(v0, per_near), v_low), scale);
    const F bottom = L::multiply(L::subtract(L::multiply(v1, per_near), v_low), scale);
    const F column = L::max(zero, L::ceil(L::add(left, margin))), row = L::max(zero, L::ceil(L::add(top, margin)));
    const M holds_bin = L::both(L::less_equal(L::add(column, one), L::subtract(right, margin)),
                                L::less_equal(L::add(row, one), L::subtract(bottom, margin)));
    const M in_grid = L::both(L::less_than(L::multiply(column, grow), L::broadcast(static_cast<float>(face.columns))),
                              L::less_than(L::multiply(row, grow), L::broadcast(static_cast<float>(face.rows))));
    const M inside = L::both(L::both(asked, ahead), L::both(holds_bin, in_grid));
    if (!L::any(inside)) return inside;
    const F farthest = L::gather(face.farthest, bin_at(level, L::to_uint(row), L::to_uint(column)), inside);
    return L::both(inside, L::less_equal(L::multiply(far, L::broadcast(1 + beam_margin)), farthest));
  }

  // No ray in the bins that the cell's directions can lie in (2 x 2 at a suitable level) reaches it. Those bins go to
  // `octant`.
  M unreached(M asked, SeenOctant& octant, int first) const {
    const F zero = L::broadcast(0.0f), per_far = L::divide(L::broadcast(1.0f), far);
    const F left =
        in_bins(L::multiply(u0, L::select(L::less_than(u0, zero), per_near, per_far)), face.u_low, -beam_bin_margin);
    const F right =
        in_bins(L::multiply(u1, L::select(L::less_than(u1, zero), per_far, per_near)), face.u_low, beam_bin_margin);
    const F top =
        in_bins(L::multiply(v0, L::select(L::less_than(v0, zero), per_near, per_far)), face.v_low, -beam_bin_margin);
    const F bottom =
        in_bins(L::multiply(v1, L::select(L::less_than(v1, zero), per_far, per_near)), face.v_low, beam_bin_margin);
    const F columns = L::broadcast(static_cast<float>(face.columns)),
            rows = L::broadcast(static_cast<float>(face.rows));
    asked = L::both(asked, ahead);
    const M in_grid = L::both(L::both(L::less_than(left, columns), L::less_equal(zero, right)),
                              L::both(L::less_than(top, rows), L::less_equal(zero, bottom)));
    const M outside = L::both(asked, L::invert(in_grid));
    asked = L::both(asked, in_grid);
    if (!L::any(asked)) return outside;
    const F last_column = L::broadcast(static_cast<float>(face.columns - 1)),
            last_row = L::broadcast(static_cast<float>(face.rows - 1));
    const U column0 = L::to_uint(L::max(left, zero)), column1 = L::to_uint(L::min(right, last_column));
    const U row0 = L::to_uint(L::max(top, zero)), row1 = L::to_uint(L::min(bottom, last_row));
    L::store(octant.first_column + first, column0);
    L::store(octant.last_column + first, column1);
    L::store(octant.first_row + first, row0);
    L::store(octant.last_row + first, row1);
    const F span = L::max(L::to_float(L::subtract(column1, column0)), L::to_float(L::subtract(row1, row0)));
    const U level = L::level_of(L::subtract(span, L::broadcast(0.5f)), 1, face.levels - 1);
    const U left_bin = L::shift_right(column0, level), right_bin = L::shift_right(column1, level);
    const U top_bin = L::shift_right(row0, level), bottom_bin = L::shift_right(row1, level);
    const F upper = L::max(L::gather(face.farthest, bin_at(level, top_bin, left_bin), asked),
                           L::gather(face.farthest, bin_at(level, top_bin, right_bin), asked));
    const F lower = L::max(L::gather(face.farthest, bin_at(level, bottom_bin, left_bin), asked),
                           L::gather(face.farthest, bin_at(level, bottom_bin, right_bin), asked));
    const M short_of = L::less_equal(L::max(upper, lower), L::multiply(near, L::broadcast(1 - beam_margin)));
    return L::either(outside, L::both(asked, short_of));
  }

  // The deepest ray of the bin that the direction through the cell at (u0 + du, v0 + dv), half its depth, lies in
  // passes the cell for certain.
  M passed_by_deepest(const BeamScan& scan, M asked, float du, float dv) const {
    const F zero = L::broadcast(0.0f);
    const F per_middle = L::divide(L::broadcast(1.0f), L::add(near, L::broadcast(0.5f)));
    const F column = in_bins(L::multiply(L::add(u0, L::broadcast(du)), per_middle), face.u_low, 0);
    const F row = in_bins(L::multiply(L::add(v0, L::broadcast(dv)), per_middle), face.v_low, 0);
    asked = L::both(
        L::both(asked, ahead),
        L::both(
            L::both(L::less_equal(zero, column), L::less_than(column, L::broadcast(static_cast<float>(face.columns)))),
            L::both(L::less_equal(zero, row), L::less_than(row, L::broadcast(static_cast<float>(face.rows))))));
    if (!L::any(asked)) return asked;
    const U bin = L::add(L::multiply(L::to_uint(row), L::broadcast(static_cast<std::uint32_t>(face.columns))),
                         L::to_uint(column));
    const U ray = L::gather(face.deepest, bin, asked);
    const U at = L::add(L::add(ray, ray), L::add(ray, ray));  // four values each
    const F inverse_u = L::gather(&scan.rays->inverse_u, at, asked);
    const F inverse_v = L::gather(&scan.rays->inverse_v, at, asked);
    const F depth = L::gather(&scan.rays->depth, at, asked), slack = L::multiply(far, L::broadcast(beam_margin));
    const F cross_u0 = L::multiply(u0, inverse_u), cross_u1 = L::multiply(u1, inverse_u);
    const F cross_v0 = L::multiply(v0, inverse_v), cross_v1 = L::multiply(v1, inverse_v);
    const F enter = L::max(near, L::max(L::min(cross_u0, cross_u1), L::min(cross_v0, cross_v1)));
    const F leave = L::min(far, L::min(L::max(cross_u0, cross_u1), L::max(cross_v0, cross_v1)));
    const F flat = L::broadcast(0.5f / beam_flat);
    const M certain = L::both(L::less_than(L::absolute(inverse_u), flat), L::less_than(L::absolute(inverse_v), flat));
    return L::both(L::both(asked, certain),
                   L::both(L::less_equal(L::add(enter, slack), leave), L::less_equal(L::add(leave, slack), depth)));
  }

 private:
  F in_bins(F direction, float low, float offset) const {
    return L::multiply_add(L::subtract(direction, L::broadcast(low)), L::broadcast(face.bins_per_unit),
                           L::broadcast(offset));
  }
  U bin_at(U level, U row, U column) const {
    return L::add(L::lookup(face.level_start, level),
                  L::add(L::multiply(row, L::lookup(face.level_columns, level)), column));
  }
};
