// Lower bounds of the squared distances of voxels from sixteen boxes or triangles of a mesh at once, in float32:
// callers grow the cubes by more than rounding can take from sizes, and shrink the bounds by more than it can take from
// distances. Included once per instruction set, inside its namespace, after cube_tests.inc.hpp.
//
// The bound of a box is the larger of two distances between boxes that share their axes: the map's, and its own, in
// which a cube of half edge h reaches h * reach_per_half. That of a triangle is the larger of the distances of its box
// along the map's axes and of its plane. Lanes count that are set in `asked`. Of two values max() takes the second
// where the first is not a number, as bounds are that overflow.

template <class L>
typename L::Float square_of_gap(typename L::Float distance, typename L::Float reach) {
  const typename L::Float gap = L::max(L::subtract(distance, reach), L::broadcast(0));
  return L::multiply(gap, gap);
}

template <class L>
void keep_near(typename L::Float bound, int l, std::uint32_t asked, float limit, NearLanes& near) {
  const unsigned below = L::bits(L::greater(L::broadcast(limit), bound)) & (asked >> l) & ((1u << L::width) - 1);
  if (below == 0) return;
  near.lanes |= below << l;
  near.least = L::least(near.least, bound, below);
}

template <class L>
typename L::Float along(const typename L::Float (&v)[3], const typename L::Float (&axis)[3]) {
  return L::multiply_add(v[2], axis[2], L::multiply_add(v[1], axis[1], L::multiply(v[0], axis[0])));
}

template <class L>
NearLanes boxes_near_cube(const PlacedBoxes& boxes, const LocalCube& cube, std::uint32_t asked, float limit) {
  using F = typename L::Float;
  const F h = L::broadcast(cube.half);
  NearLanes near{limit, 0};
  for (int l = 0; l < 16; l += L::width) {
    F d[3], axis[3], by_map = L::broadcast(0), by_box = by_map;
    for (int c = 0; c < 3; ++c) {
      d[c] = L::subtract(L::broadcast(cube.centre[c]), L::load(boxes.centre[c] + l));
      by_map = L::add(by_map, square_of_gap<L>(L::abs(d[c]), L::add(h, L::load(boxes.extent[c] + l))));
    }
    for (int j = 0; j < 3; ++j) {
      load_rows<L>(boxes.axis[j], l, axis);
      const F reach = L::multiply_add(h, L::load(boxes.reach_per_half[j] + l), L::load(boxes.half[j] + l));
      by_box = L::add(by_box, square_of_gap<L>(L::abs(along<L>(d, axis)), reach));
    }
    keep_near<L>(L::max(by_box, by_map), l, asked, limit, near);
  }
  return near;
}

// Sums over the three axes, for each octant, of one of two values an axis.
template <class L>
typename L::Float octant_sum(const typename L::Float (&value)[3][2], int octant) {
  return L::add(L::add(value[0][octant & 1], value[1][octant >> 1 & 1]), value[2][octant >> 2]);
}

template <class L>
void boxes_near_octants(const PlacedBoxes& boxes, const LocalOctants& cubes, unsigned octants, std::uint32_t asked,
                        float limit, NearLanes* near) {
  using F = typename L::Float;
  const F h = L::broadcast(cubes.half), q = L::broadcast(cubes.quarter), zero = L::broadcast(0);
  for (int i = 0; i < 8; ++i) near[i] = {limit, 0};
  for (int l = 0; l < 16; l += L::width) {
    F d[3], gap[3][2], middle[3], reach[3], shift[3][3][2], axis[3];
    for (int c = 0; c < 3; ++c) {
      d[c] = L::subtract(L::broadcast(cubes.centre[c]), L::load(boxes.centre[c] + l));
      const F extent = L::add(h, L::load(boxes.extent[c] + l));
      gap[c][0] = square_of_gap<L>(L::abs(L::subtract(d[c], q)), extent);
      gap[c][1] = square_of_gap<L>(L::abs(L::add(d[c], q)), extent);
    }
    for (int j = 0; j < 3; ++j) {
      load_rows<L>(boxes.axis[j], l, axis);
      middle[j] = along<L>(d, axis);
      reach[j] = L::multiply_add(h, L::load(boxes.reach_per_half[j] + l), L::load(boxes.half[j] + l));
      for (int c = 0; c < 3; ++c) {
        shift[j][c][1] = L::multiply(q, axis[c]);
        shift[j][c][0] = L::subtract(zero, shift[j][c][1]);
      }
    }
    for (unsigned rest = octants; rest; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      F by_box = zero;
      for (int j = 0; j < 3; ++j) {
        const F at = L::add(middle[j], octant_sum<L>(shift[j], i));
        by_box = L::add(by_box, square_of_gap<L>(L::abs(at), reach[j]));
      }
      keep_near<L>(L::max(by_box, octant_sum<L>(gap, i)), l, asked, limit, near[i]);
    }
  }
}

// A triangle's box along the map's axes, and its extent along its normal, relative to a point; 1 / |normal|^2, or less
// for one of no area, and |normal|_1.
template <class L>
struct TriangleSlabs {
  using F = typename L::Float;
  F low[3], high[3], normal[3], low_along, high_along, inverse_square, reach_per_half;

  TriangleSlabs(const TriangleBlock& triangles, const float* origin, int l) {
    F v[3][3], e[2][3], at[3];
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k) v[k][c] = L::subtract(L::load(triangles.corner[k][c] + l), L::broadcast(origin[c]));
      low[c] = L::min(L::min(v[0][c], v[1][c]), v[2][c]);
      high[c] = L::max(L::max(v[0][c], v[1][c]), v[2][c]);
      for (int k = 0; k < 2; ++k) e[k][c] = L::subtract(v[k + 1][c], v[k][c]);
    }
    F square = L::broadcast(0x1p-100f);
    reach_per_half = L::broadcast(0);
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      normal[c] = L::multiply_subtract(e[0][a], e[1][b], L::multiply(e[0][b], e[1][a]));
      square = L::multiply_add(normal[c], normal[c], square);
      reach_per_half = L::add(reach_per_half, L::abs(normal[c]));
    }
    inverse_square = L::divide(L::broadcast(1), square);
    // All corners are projected, so that a normal computed badly bounds nothing wrongly.
    for (int k = 0; k < 3; ++k) at[k] = along<L>(v[k], normal);
    low_along = L::min(L::min(at[0], at[1]), at[2]);
    high_along = L::max(L::max(at[0], at[1]), at[2]);
  }
  /// Squared gap along c to a cube of half edge h whose centre is at `at`.
  F gap(int c, F at, F h) const {
    return square_of_gap<L>(L::max(L::subtract(low[c], at), L::subtract(at, high[c])), h);
  }
  /// Squared gap along the normal, where that centre is at `at` along it.
  F gap_along(F at, F h) const {
    const F apart = L::max(L::subtract(low_along, at), L::subtract(at, high_along));
    return L::multiply(square_of_gap<L>(apart, L::multiply(h, reach_per_half)), inverse_square);
  }
};

template <class L>
NearLanes triangles_near_cube(const TriangleBlock& triangles, const LocalCube& cube, std::uint32_t asked, float limit) {
  using F = typename L::Float;
  const F h = L::broadcast(cube.half), zero = L::broadcast(0);
  NearLanes near{limit, 0};
  for (int l = 0; l < 16; l += L::width) {
    const TriangleSlabs<L> slabs(triangles, cube.centre, l);
    const F by_map = L::add(L::add(slabs.gap(0, zero, h), slabs.gap(1, zero, h)), slabs.gap(2, zero, h));
    keep_near<L>(L::max(slabs.gap_along(zero, h), by_map), l, asked, limit, near);
  }
  return near;
}

template <class L>
void triangles_near_octants(const TriangleBlock& triangles, const LocalOctants& cubes, unsigned octants,
                            std::uint32_t asked, float limit, NearLanes* near) {
  using F = typename L::Float;
  const F h = L::broadcast(cubes.half), q = L::broadcast(cubes.quarter), zero = L::broadcast(0);
  for (int i = 0; i < 8; ++i) near[i] = {limit, 0};
  for (int l = 0; l < 16; l += L::width) {
    const TriangleSlabs<L> slabs(triangles, cubes.centre, l);
    F gap[3][2], shift[3][2];
    for (int c = 0; c < 3; ++c) {
      gap[c][0] = slabs.gap(c, L::subtract(zero, q), h);
      gap[c][1] = slabs.gap(c, q, h);
      shift[c][1] = L::multiply(q, slabs.normal[c]);
      shift[c][0] = L::subtract(zero, shift[c][1]);
    }
    for (unsigned rest = octants; rest; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      const F by_plane = slabs.gap_along(octant_sum<L>(shift, i), h);
      keep_near<L>(L::max(by_plane, octant_sum<L>(gap, i)), l, asked, limit, near[i]);
    }
  }
}
