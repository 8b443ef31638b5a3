// One triangle against up to L::width at once, in float32 with error bounds: certainly apart, certainly touching, or
// undecided. Two triangles are apart if no edge of one meets the other; whether an edge does follows from the sides of
// the plane its ends are on, and from the signs of the volumes it spans with the other's edges.

template <class L>
struct TriangleLanes {
  typename L::Float corner[3][3];  // relative to the single triangle's first corner
};

/// A triangle whose first corner is the origin.
struct OneTriangle {
  float e1[3], e2[3], normal[3];
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

  FilterBounds(float extent_a, typename L::Float extent_b, float difference_error) {
    const auto a = L::broadcast(extent_a * (1 + 0x1p-20f) + difference_error);
    const auto b = L::add(extent_b, L::broadcast(difference_error));
    const auto reach = L::add(a, b);
    // Where products underflow, nothing is decided here.
    const auto least = L::broadcast(1e-35f);
    const auto e = L::multiply_add(reach, L::broadcast(0x1p-23f), L::broadcast(difference_error));
    const auto twelve_reach = L::multiply(reach, L::broadcast(12.0f));
    side_of_b = L::multiply_add(L::multiply(e, a), L::multiply_add(a, L::broadcast(6.0f), twelve_reach), least);
    side_of_a = L::multiply_add(L::multiply(e, b), L::multiply_add(b, L::broadcast(6.0f), twelve_reach), least);
    volume = L::multiply_add(L::multiply(e, reach), twelve_reach, least);
  }
};

template <class L>
typename L::Float dot(const float* a, const typename L::Float* b) {
  const auto xy = L::multiply_add(L::broadcast(a[1]), b[1], L::multiply(L::broadcast(a[0]), b[0]));
  return L::multiply_add(L::broadcast(a[2]), b[2], xy);
}

template <class L>
void cross(const typename L::Float* a, const typename L::Float* b, typename L::Float* out) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    out[i] = L::multiply_subtract(a[j], b[k], L::multiply(a[k], b[j]));
  }
}

/// Which values are certainly above, and certainly below, zero.
template <class L>
struct Signs {
  typename L::Mask above, below;

  Signs(typename L::Float value, typename L::Float bound)
      : above(L::greater(value, bound)), below(L::greater(L::subtract(L::broadcast(0.0f), bound), value)) {}
};

template <class L>
struct EdgeVerdict {
  typename L::Mask misses, meets;

  // `from`, `to`: the sides of the plane the edge's ends are on; v: the volumes with the triangle's edges.
  EdgeVerdict(const Signs<L>& from, const Signs<L>& to, const Signs<L>& v0, const Signs<L>& v1, const Signs<L>& v2) {
    const auto one_side = L::either(L::both(from.above, to.above), L::both(from.below, to.below));
    const auto some_above = L::either(L::either(v0.above, v1.above), v2.above);
    const auto some_below = L::either(L::either(v0.below, v1.below), v2.below);
    misses = L::either(one_side, L::both(some_above, some_below));
    const auto crosses = L::either(L::both(from.above, to.below), L::both(from.below, to.above));
    const auto all_above = L::both(L::both(v0.above, v1.above), v2.above);
    const auto all_below = L::both(L::both(v0.below, v1.below), v2.below);
    meets = L::both(crosses, L::either(all_above, all_below));
  }
};

template <class L>
Verdicts filter_by_edges(const OneTriangle& a, const TriangleLanes<L>& b, const typename L::Float* side_of_b,
                         const Signs<L>* a_sign, const Signs<L>* b_sign, typename L::Float bound) {
  typename L::Float volume[3][3];  // of a's edge i with b's edge j
  for (int j = 0; j < 3; ++j) {
    typename L::Float moment[3];
    cross<L>(b.corner[j], b.corner[(j + 1) % 3], moment);
    volume[0][j] = dot<L>(a.e1, moment);
    volume[2][j] = L::subtract(L::broadcast(0.0f), dot<L>(a.e2, moment));
    // The sum over a's edges is the volume of a with b's edge.
    const auto along = L::subtract(side_of_b[(j + 1) % 3], side_of_b[j]);
    volume[1][j] = L::subtract(along, L::add(volume[0][j], volume[2][j]));
  }
  unsigned all_miss = ~0u, some_meet = 0;
  for (int i = 0; i < 3; ++i) {
    const Signs<L> a0(volume[i][0], bound), a1(volume[i][1], bound), a2(volume[i][2], bound);
    const EdgeVerdict<L> of_a(a_sign[i], a_sign[(i + 1) % 3], a0, a1, a2);
    const Signs<L> b0(volume[0][i], bound), b1(volume[1][i], bound), b2(volume[2][i], bound);
    const EdgeVerdict<L> of_b(b_sign[i], b_sign[(i + 1) % 3], b0, b1, b2);
    all_miss &= L::bits(L::both(of_a.misses, of_b.misses));
    some_meet |= L::bits(L::either(of_a.meets, of_b.meets));
  }
  return {all_miss, some_meet};
}

/// `wanted`: the lanes to look at. `b_normal`: of the lanes' triangles.
template <class L>
Verdicts filter_triangles(const OneTriangle& a, const TriangleLanes<L>& b, const typename L::Float* b_normal,
                          const FilterBounds<L>& bound, unsigned wanted) {
  typename L::Float side_of_b[3];
  for (int i = 0; i < 3; ++i) side_of_b[i] = dot<L>(a.normal, b.corner[i]);
  const Signs<L> b_sign[3] = {
      {side_of_b[0], bound.side_of_b}, {side_of_b[1], bound.side_of_b}, {side_of_b[2], bound.side_of_b}};
  const auto one_sided = [](const Signs<L>* s) {
    return L::bits(L::either(L::both(L::both(s[0].above, s[1].above), s[2].above),
                             L::both(L::both(s[0].below, s[1].below), s[2].below)));
  };
  unsigned apart = one_sided(b_sign);
  if ((wanted & ~apart) == 0) return {apart, 0};
  auto b_offset = L::multiply(b_normal[0], b.corner[0][0]);
  b_offset = L::multiply_add(b_normal[1], b.corner[0][1], b_offset);
  b_offset = L::multiply_add(b_normal[2], b.corner[0][2], b_offset);
  const Signs<L> a_sign[3] = {{L::subtract(L::broadcast(0.0f), b_offset), bound.side_of_a},
                              {L::subtract(dot<L>(a.e1, b_normal), b_offset), bound.side_of_a},
                              {L::subtract(dot<L>(a.e2, b_normal), b_offset), bound.side_of_a}};
  apart |= one_sided(a_sign);
  if ((wanted & ~apart) == 0) return {apart, 0};
  const Verdicts by_edges = filter_by_edges<L>(a, b, side_of_b, a_sign, b_sign, bound.volume);
  return {apart | by_edges.apart, by_edges.touching & ~apart};
}
