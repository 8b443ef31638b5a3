// Pairs of triangles, L::width at once, in float32 with error bounds: certainly apart, certainly touching, or
// undecided. Two triangles are apart if no edge of one meets the other; whether an edge does follows from the sides of
// the plane its ends are on, and from the signs of the volumes it spans with the other's edges.

/// Relative to the first triangle's first corner.
template <class L>
struct TrianglePairLanes {
  typename L::Float a_edge[2][3];        // from its first corner to the others
  typename L::Float b[3][3];             // corners
  typename L::Float a_extent, b_extent;  // largest difference of two corners in one coordinate
  typename L::Float difference_error;    // of the difference of two corners in a coordinate
};

struct Verdicts {
  unsigned apart, touching;  // bit per lane
};

/// Bounds of the errors of the determinants below. Extents are the largest coordinate difference within a triangle;
/// triangles whose boxes meet lie within the sum of both, `reach`. If every difference is off by at most e, then
/// det(x, y, z) is by at most e (|x cross y| + |y cross z| + |z cross x|), each of these at most 5.2 times the product
/// of the largest coordinates; the rest is for the roundings after that.
template <class L>
struct FilterBounds {
  typename L::Float side_of_b, side_of_a, volume;

  explicit FilterBounds(const TrianglePairLanes<L>& pair) {
    const auto a = L::multiply_add(pair.a_extent, L::broadcast(1 + 0x1p-20f), pair.difference_error);
    const auto b = L::multiply_add(pair.b_extent, L::broadcast(1 + 0x1p-20f), pair.difference_error);
    const auto reach = L::add(a, b);
    // Where products underflow, nothing is decided here.
    const auto least = L::broadcast(1e-35f);
    const auto e = L::multiply_add(reach, L::broadcast(0x1p-23f), pair.difference_error);
    const auto twelve_reach = L::multiply(reach, L::broadcast(12.0f));
    side_of_b = L::multiply_add(L::multiply(e, a), L::multiply_add(a, L::broadcast(6.0f), twelve_reach), least);
    side_of_a = L::multiply_add(L::multiply(e, b), L::multiply_add(b, L::broadcast(6.0f), twelve_reach), least);
    volume = L::multiply_add(L::multiply(e, reach), twelve_reach, least);
  }
};

template <class L>
typename L::Float dot(const typename L::Float* a, const typename L::Float* b) {
  return L::multiply_add(a[2], b[2], L::multiply_add(a[1], b[1], L::multiply(a[0], b[0])));
}

template <class L>
void cross(const typename L::Float* a, const typename L::Float* b, typename L::Float* out) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    out[i] = L::multiply_subtract(a[j], b[k], L::multiply(a[k], b[j]));
  }
}

/// The least and the largest of some determinants, each off by less than a bound.
template <class L>
struct SignRange {
  typename L::Float low, high;

  SignRange(typename L::Float x, typename L::Float y) : low(L::min(x, y)), high(L::max(x, y)) {}
  SignRange(typename L::Float x, typename L::Float y, typename L::Float z)
      : low(L::min(L::min(x, y), z)), high(L::max(L::max(x, y), z)) {}

  /// Lanes where all are certainly above, or all certainly below, zero.
  unsigned one_sided(typename L::Float bound) const {
    return L::bits(L::either(L::greater(low, bound), L::greater(L::subtract(L::broadcast(0.0f), bound), high)));
  }
  /// Lanes where one is certainly above and one certainly below zero.
  unsigned both_sides(typename L::Float bound) const {
    return L::bits(L::both(L::greater(high, bound), L::greater(L::subtract(L::broadcast(0.0f), bound), low)));
  }
};

/// `volume`: of a's edge i with b's edge j. `side`: of each one's corners, of the other's plane.
template <class L>
Verdicts filter_by_edges(const typename L::Float (&volume)[3][3], const typename L::Float* side_of_a,
                         const typename L::Float* side_of_b, const FilterBounds<L>& bound, unsigned wanted) {
  unsigned all_miss = ~0u, some_meet = 0;
  for (int i = 0; i < 3; ++i) {
    const int next = (i + 1) % 3;
    const SignRange<L> a_ends(side_of_a[i], side_of_a[next]), a_volumes(volume[i][0], volume[i][1], volume[i][2]);
    const SignRange<L> b_ends(side_of_b[i], side_of_b[next]), b_volumes(volume[0][i], volume[1][i], volume[2][i]);
    all_miss &= a_ends.one_sided(bound.side_of_a) | a_volumes.both_sides(bound.volume);
    all_miss &= b_ends.one_sided(bound.side_of_b) | b_volumes.both_sides(bound.volume);
    if ((wanted & ~all_miss) == 0) continue;
    some_meet |= a_ends.both_sides(bound.side_of_a) & a_volumes.one_sided(bound.volume);
    some_meet |= b_ends.both_sides(bound.side_of_b) & b_volumes.one_sided(bound.volume);
  }
  return {all_miss, some_meet};
}

/// `wanted`: the lanes to look at.
template <class L>
Verdicts filter_triangles(const TrianglePairLanes<L>& pair, unsigned wanted) {
  using F = typename L::Float;
  const FilterBounds<L> bound(pair);
  const F *e1 = pair.a_edge[0], *e2 = pair.a_edge[1];
  F a_normal[3], side_of_b[3];
  cross<L>(e1, e2, a_normal);
  for (int i = 0; i < 3; ++i) side_of_b[i] = dot<L>(a_normal, pair.b[i]);
  unsigned apart = SignRange<L>(side_of_b[0], side_of_b[1], side_of_b[2]).one_sided(bound.side_of_b);
  if ((wanted & ~apart) == 0) return {apart, 0};

  F f1[3], f2[3], b_normal[3];
  for (int c = 0; c < 3; ++c) {
    f1[c] = L::subtract(pair.b[1][c], pair.b[0][c]);
    f2[c] = L::subtract(pair.b[2][c], pair.b[0][c]);
  }
  cross<L>(f1, f2, b_normal);
  const F b_offset = dot<L>(b_normal, pair.b[0]);
  const F side_of_a[3] = {L::subtract(L::broadcast(0.0f), b_offset), L::subtract(dot<L>(e1, b_normal), b_offset),
                          L::subtract(dot<L>(e2, b_normal), b_offset)};
  apart |= SignRange<L>(side_of_a[0], side_of_a[1], side_of_a[2]).one_sided(bound.side_of_a);
  if ((wanted & ~apart) == 0) return {apart, 0};

  F volume[3][3];
  for (int j = 0; j < 3; ++j) {
    F moment[3];
    cross<L>(pair.b[j], pair.b[(j + 1) % 3], moment);
    volume[0][j] = dot<L>(e1, moment);
    volume[2][j] = L::subtract(L::broadcast(0.0f), dot<L>(e2, moment));
    // The sum over a's edges is the volume of a with b's edge.
    const F along = L::subtract(side_of_b[(j + 1) % 3], side_of_b[j]);
    volume[1][j] = L::subtract(along, L::add(volume[0][j], volume[2][j]));
  }
  const Verdicts by_edges = filter_by_edges<L>(volume, side_of_a, side_of_b, bound, wanted & ~apart);
  return {apart | by_edges.apart, by_edges.touching & ~apart};
}
