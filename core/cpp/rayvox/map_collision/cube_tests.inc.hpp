// A voxel against sixteen boxes or triangles of a mesh at once, in float32. What they separate is separated: callers
// grow the cube by more than rounding can take. Included once per instruction set, inside its namespace, after its
// CollisionLanes.

// The cells of an octant in Morton order: each one's steps from the first along x, y and z, and which lie at each step.
struct OctantLayout {
  alignas(64) float offset[3][64] = {};
  std::uint64_t slice[3][4] = {};

  constexpr OctantLayout() {
    for (int cell = 0; cell < 64; ++cell) {
      for (int c = 0; c < 3; ++c) {
        const int step = (cell >> c & 1) + 2 * (cell >> (c + 3) & 1);
        offset[c][cell] = static_cast<float>(step);
        slice[c][step] |= std::uint64_t{1} << cell;
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

/// Which of the 64 cells of an octant (4x4x4, in Morton order) the box of one lane may meet: those that neither the
/// map's axes nor its own separate from it.
template <class L>
std::uint64_t cells_meeting_box(const PlacedBoxes& boxes, int lane, const LocalCells& cells) {
  using F = typename L::Float;
  std::uint64_t meeting = ~std::uint64_t{0};
  float d[3];
  for (int c = 0; c < 3; ++c) {
    d[c] = cells.first_centre[c] - boxes.centre[c][lane];
    const float reach = cells.half + boxes.extent[c][lane];
    std::uint64_t along = 0;
    for (int i = 0; i < 4; ++i) {
      const float at = d[c] + static_cast<float>(i) * cells.edge;
      along |= (at <= reach) & (at >= -reach) ? octant_layout.slice[c][i] : 0;
    }
    meeting &= along;
  }
  for (int j = 0; j < 3 && meeting; ++j) {
    const float ax = boxes.axis[j][0][lane], ay = boxes.axis[j][1][lane], az = boxes.axis[j][2][lane];
    const F start = L::broadcast(d[0] * ax + d[1] * ay + d[2] * az);
    const F x = L::broadcast(ax * cells.edge), y = L::broadcast(ay * cells.edge), z = L::broadcast(az * cells.edge);
    const F reach = L::broadcast(cells.half * boxes.reach_per_half[j][lane] + boxes.half[j][lane]);
    for (int l = 0; l < 64; l += L::width) {
      F at = L::multiply_add(L::load(octant_layout.offset[0] + l), x, start);
      at = L::multiply_add(L::load(octant_layout.offset[1] + l), y, at);
      at = L::multiply_add(L::load(octant_layout.offset[2] + l), z, at);
      meeting &= ~(std::uint64_t{L::bits(L::greater(L::abs(at), reach))} << l);
    }
  }
  return meeting;
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
