// Lower bounds of the distances of a voxel from sixteen boxes or triangles of a mesh at once, in float32: callers grow
// the cube by more than rounding can take from sizes, and shrink the bounds by more than it can take from distances.
// Included once per instruction set, inside its namespace, after cube_tests.inc.hpp.

template <class L>
typename L::Float square_of_gap(typename L::Float distance, typename L::Float reach) {
  const typename L::Float gap = L::max(L::subtract(distance, reach), L::broadcast(0));
  return L::multiply(gap, gap);
}

/// The lanes whose bound is below the limit. The bound of a box is the larger of two distances of boxes that share
/// their axes: the map's, and its own, in which a cube of half edge h reaches h * reach_per_half.
template <class L>
unsigned boxes_near_cube(const PlacedBoxes& boxes, const LocalCube& cube, float squared_limit, float* squared) {
  using F = typename L::Float;
  const F h = L::broadcast(cube.half);
  unsigned near = 0;
  for (int l = 0; l < 16; l += L::width) {
    F d[3], by_map = L::broadcast(0), by_box = by_map;
    for (int c = 0; c < 3; ++c) {
      d[c] = L::subtract(L::broadcast(cube.centre[c]), L::load(boxes.centre[c] + l));
      by_map = L::add(by_map, square_of_gap<L>(L::abs(d[c]), L::add(h, L::load(boxes.extent[c] + l))));
    }
    for (int j = 0; j < 3; ++j) {
      F at = L::multiply(d[0], L::load(boxes.axis[j][0] + l));
      at = L::multiply_add(d[1], L::load(boxes.axis[j][1] + l), at);
      at = L::multiply_add(d[2], L::load(boxes.axis[j][2] + l), at);
      const F reach = L::multiply_add(h, L::load(boxes.reach_per_half[j] + l), L::load(boxes.half[j] + l));
      by_box = L::add(by_box, square_of_gap<L>(L::abs(at), reach));
    }
    const F bound = L::max(by_map, by_box);
    L::store(squared + l, bound);
    near |= L::bits(L::greater(L::broadcast(squared_limit), bound)) << l;
  }
  return near;
}

/// The lanes that neither their boxes along the map's axes, whose squared distances are stored, nor their planes show
/// to lie beyond the limit.
template <class L>
unsigned triangles_near_cube(const TriangleBlock& triangles, const LocalCube& cube, float squared_limit,
                             float* squared) {
  using F = typename L::Float;
  const F h = L::broadcast(cube.half), zero = L::broadcast(0), limit = L::broadcast(squared_limit);
  unsigned near = 0;
  for (int l = 0; l < 16; l += L::width) {
    F v[3][3], bound = zero;
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k)
        v[k][c] = L::subtract(L::load(triangles.corner[k][c] + l), L::broadcast(cube.centre[c]));
      const F low = L::min(L::min(v[0][c], v[1][c]), v[2][c]), high = L::max(L::max(v[0][c], v[1][c]), v[2][c]);
      bound = L::add(bound, square_of_gap<L>(L::max(low, L::subtract(zero, high)), h));
    }
    L::store(squared + l, bound);
    F e[2][3], n[3], at[3];
    for (int k = 0; k < 2; ++k) {
      for (int c = 0; c < 3; ++c) e[k][c] = L::subtract(v[k + 1][c], v[k][c]);
    }
    F length = zero, reach = zero;
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      n[c] = L::multiply_subtract(e[0][a], e[1][b], L::multiply(e[0][b], e[1][a]));
      length = L::multiply_add(n[c], n[c], length);
      reach = L::multiply_add(h, L::abs(n[c]), reach);
    }
    for (int k = 0; k < 3; ++k) {
      at[k] = L::multiply_add(n[2], v[k][2], L::multiply_add(n[1], v[k][1], L::multiply(n[0], v[k][0])));
    }
    const F low = L::min(L::min(at[0], at[1]), at[2]), high = L::max(L::max(at[0], at[1]), at[2]);
    const F gap = square_of_gap<L>(L::max(low, L::subtract(zero, high)), reach);
    const unsigned beyond_plane = L::bits(L::greater(gap, L::multiply(limit, length)));
    near |= (L::bits(L::greater(limit, bound)) & ~beyond_plane) << l;
  }
  return near;
}
