// A voxel against sixteen boxes or triangles of a mesh at once, in float32. What they separate is separated: callers
// grow the cube by more than rounding can take. Included once per instruction set, inside its namespace, after its
// CollisionLanes.

// The cells of an octant in Morton order: each one's steps from the first along x, y and z, and
// which lie from a step on, and up to one.
struct OctantLayout {
  alignas(64) float offset[3][64] = {};
  std::uint64_t slices_from[3][4] = {}, slices_to[3][4] = {};

  constexpr OctantLayout() {
    for (int cell = 0; cell < 64; ++cell) {
      for (int c = 0; c < 3; ++c) {
        const int step = (cell >> c & 1) + 2 * (cell >> (c + 3) & 1);
        offset[c][cell] = static_cast<float>(step);
        for (int i = 0; i <= step; ++i) slices_from[c][i] |= std::uint64_t{1} << cell;
        for (int i = step; i < 4; ++i) slices_to[c][i] |= std::uint64_t{1} << cell;
      }
    }
  }
};
constexpr OctantLayout octant_layout;

template <class L>
typename L::Float rotated(const float* row, const typename L::Float (&v)[3]) {
  const typename L::Float xy = L::multiply_add(L::broadcast(row[1]), v[1], L::multiply(L::broadcast(row[0]), v[0]));
  return L::multiply_add(L::broadcast(row[2]), v[2], xy);
}

template <class L>
void load_rows(const float (*rows)[16], int l, typename L::Float (&v)[3]) {
  for (int c = 0; c < 3; ++c) v[c] = L::load(rows[c] + l);
}

/// Turns the boxes by `rotation` (row-major) and grows them by `margin_m`.
template <class L>
void place_boxes(const BoxBlock& boxes, const float* rotation, float margin_m, PlacedBoxes& out) {
  using F = typename L::Float;
  for (int l = 0; l < 16; l += L::width) {
    F v[3], extent[3];
    load_rows<L>(boxes.centre, l, v);
    for (int c = 0; c < 3; ++c) {
      L::store(out.centre[c] + l, rotated<L>(rotation + 3 * c, v));
      extent[c] = L::broadcast(margin_m);
    }
    for (int j = 0; j < 3; ++j) {
      load_rows<L>(boxes.axis[j], l, v);
      const F half = L::add(L::load(boxes.half[j] + l), L::broadcast(margin_m));
      F reach = L::broadcast(0);
      for (int c = 0; c < 3; ++c) {
        const F coordinate = rotated<L>(rotation + 3 * c, v), magnitude = L::abs(coordinate);
        L::store(out.axis[j][c] + l, coordinate);
        reach = L::add(reach, magnitude);
        extent[c] = L::multiply_add(half, magnitude, extent[c]);
      }
      L::store(out.half[j] + l, half);
      L::store(out.reach_per_half[j] + l, reach);
    }
    for (int c = 0; c < 3; ++c) L::store(out.extent[c] + l, extent[c]);
  }
}

/// The lanes whose boxes neither the map's axes nor their own separate from the cube.
template <class L>
unsigned boxes_meeting_cube(const PlacedBoxes& boxes, const LocalCube& cube) {
  using F = typename L::Float;
  const F h = L::broadcast(cube.half);
  unsigned meeting = 0;
  for (int l = 0; l < 16; l += L::width) {
    F d[3];
    unsigned apart = 0;
    for (int c = 0; c < 3; ++c) {
      d[c] = L::subtract(L::broadcast(cube.centre[c]), L::load(boxes.centre[c] + l));
      apart |= L::bits(L::greater(L::abs(d[c]), L::add(h, L::load(boxes.extent[c] + l))));
    }
    for (int j = 0; j < 3; ++j) {
      F at = L::multiply(d[0], L::load(boxes.axis[j][0] + l));
      at = L::multiply_add(d[1], L::load(boxes.axis[j][1] + l), at);
      at = L::multiply_add(d[2], L::load(boxes.axis[j][2] + l), at);
      const F reach = L::multiply_add(h, L::load(boxes.reach_per_half[j] + l), L::load(boxes.half[j] + l));
      apart |= L::bits(L::greater(L::abs(at), reach));
    }
    meeting |= (~apart & ((1u << L::width) - 1)) << l;
  }
  return meeting;
}

/// The steps of an octant along one axis whose cells a box may meet: bits of the cells of all of them.
inline std::uint64_t slices_within(int axis, float low, float high) {
  // Steps from ceil(low) to floor(high), of -1 to 4.
  const float from = low > 0 ? low : 0, to = high < 3 ? high : 3;
  if (!(from <= to)) return 0;
  const int first = static_cast<int>(from) + (static_cast<float>(static_cast<int>(from)) < from);
  const int last = static_cast<int>(to);
  return octant_layout.slices_from[axis][first] & octant_layout.slices_to[axis][last];
}

/// Which of some cells of an octant (4x4x4, in Morton order) the box of one lane may meet: those that neither the map's
/// axes nor its own separate from it.
template <class L>
std::uint64_t cells_meeting_box(const PlacedBoxes& boxes, int lane, const LocalCells& octant, std::uint64_t cells) {
  using F = typename L::Float;
  float d[3];
  for (int c = 0; c < 3; ++c) {
    d[c] = octant.first_centre[c] - boxes.centre[c][lane];
    const float reach = octant.half + boxes.extent[c][lane];
    cells &= slices_within(c, (-reach - d[c]) * octant.per_edge, (reach - d[c]) * octant.per_edge);
  }
  if (!cells) return 0;
  F start[3], step[3][3], reach[3];
  for (int j = 0; j < 3; ++j) {
    float along = 0;
    for (int c = 0; c < 3; ++c) {
      const float coordinate = boxes.axis[j][c][lane];
      along += d[c] * coordinate;
      step[j][c] = L::broadcast(coordinate * octant.edge);
    }
    start[j] = L::broadcast(along);
    reach[j] = L::broadcast(octant.half * boxes.reach_per_half[j][lane] + boxes.half[j][lane]);
  }
  constexpr std::uint64_t lanes = (std::uint64_t{1} << L::width) - 1;
  for (int l = 0; l < 64; l += L::width) {
    if (!(cells >> l & lanes)) continue;
    const F x = L::load(octant_layout.offset[0] + l), y = L::load(octant_layout.offset[1] + l),
            z = L::load(octant_layout.offset[2] + l);
    std::uint64_t apart = 0;
    for (int j = 0; j < 3; ++j) {
      const F at =
          L::multiply_add(z, step[j][2], L::multiply_add(y, step[j][1], L::multiply_add(x, step[j][0], start[j])));
      apart |= L::bits(L::greater(L::abs(at), reach[j]));
    }
    cells &= ~(apart << l);
  }
  return cells;
}

/// Which of 64 values are at least `least`.
template <class L>
std::uint64_t values_at_least(const float* values, float least) {
  std::uint64_t bits = 0;
  for (int l = 0; l < 64; l += L::width) {
    bits |= std::uint64_t{L::bits(L::not_less(L::load(values + l), L::broadcast(least)))} << l;
  }
  return bits;
}

template <class L>
void place_triangles(const TriangleBlock& triangles, const float* rotation, TriangleBlock& out) {
  for (int l = 0; l < 16; l += L::width) {
    for (int k = 0; k < 3; ++k) {
      typename L::Float v[3];
      load_rows<L>(triangles.corner[k], l, v);
      for (int c = 0; c < 3; ++c) L::store(out.corner[k][c] + l, rotated<L>(rotation + 3 * c, v));
    }
  }
}

/// Lanes whose three values all lie beyond `reach` on one side.
template <class L>
unsigned beyond(typename L::Float a, typename L::Float b, typename L::Float c, typename L::Float reach) {
  const typename L::Float low = L::min(L::min(a, b), c), high = L::max(L::max(a, b), c);
  return L::bits(L::greater(low, reach)) | L::bits(L::greater(L::subtract(L::broadcast(0), reach), high));
}

/// The lanes whose triangles no axis of the separating axis test (Akenine-Moller, "Fast 3D triangle-box overlap
/// testing", 2001) separates from the cube. All corners are projected on each axis, as if it were any direction, so
/// that an axis computed badly separates nothing wrongly.
template <class L>
unsigned triangles_meeting_cube(const TriangleBlock& triangles, const LocalCube& cube) {
  using F = typename L::Float;
  const F h = L::broadcast(cube.half);
  unsigned meeting = 0;
  for (int l = 0; l < 16; l += L::width) {
    F v[3][3], e[3][3];
    unsigned apart = 0;
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k)
        v[k][c] = L::subtract(L::load(triangles.corner[k][c] + l), L::broadcast(cube.centre[c]));
      apart |= beyond<L>(v[0][c], v[1][c], v[2][c], h);
    }
    const unsigned all = (1u << L::width) - 1;
    if ((apart & all) == all) continue;
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) e[k][c] = L::subtract(v[(k + 1) % 3][c], v[k][c]);
    }
    F n[3], at[3];
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      n[c] = L::multiply_subtract(e[0][a], e[1][b], L::multiply(e[0][b], e[1][a]));
    }
    for (int k = 0; k < 3; ++k) {
      at[k] = L::multiply_add(n[2], v[k][2], L::multiply_add(n[1], v[k][1], L::multiply(n[0], v[k][0])));
    }
    apart |= beyond<L>(at[0], at[1], at[2], L::multiply(h, L::add(L::add(L::abs(n[0]), L::abs(n[1])), L::abs(n[2]))));
    for (int i = 0; i < 3; ++i) {
      for (int c = 0; c < 3; ++c) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        for (int k = 0; k < 3; ++k) at[k] = L::multiply_subtract(e[i][a], v[k][b], L::multiply(e[i][b], v[k][a]));
        apart |= beyond<L>(at[0], at[1], at[2], L::multiply(h, L::add(L::abs(e[i][a]), L::abs(e[i][b]))));
      }
    }
    meeting |= (~apart & all) << l;
  }
  return meeting;
}
