// One oriented box against up to sixteen (the separating axis test of Gottschalk, Lin and Manocha, "OBBTree", 1996):
// near the leaves a box along the surface is thinner than any k-DOP.

/// A box in the frame of the node whose children it is tested against, relative to that node's origin.
struct PlacedBox {
  float centre[3], axis[3][3], half[3];
};

inline PlacedBox place_box(const BvhNode& from, const BvhNode& to, const FrameChange& change, float margin_m) {
  PlacedBox box;
  const Offset d = offset_between(from, to, change);
  box.centre[0] = d.x, box.centre[1] = d.y, box.centre[2] = d.z;
  const float* r = change.rotation_f32;
  for (int i = 0; i < 3; ++i) {
    const float* axis = from.box_axis + 3 * i;
    for (int c = 0; c < 3; ++c) box.axis[i][c] = r[3 * c] * axis[0] + r[3 * c + 1] * axis[1] + r[3 * c + 2] * axis[2];
    box.half[i] = from.box_half[i] + margin_m;
  }
  return box;
}

template <class L>
typename L::Float along_axis(const float* axis, const typename L::Float* v) {
  const auto xy = L::multiply_add(L::broadcast(axis[1]), v[1], L::multiply(L::broadcast(axis[0]), v[0]));
  return L::multiply_add(L::broadcast(axis[2]), v[2], xy);
}

/// Sixteen boxes seen from a placed box: their centres' and axes' coordinates along its axes, L::width at a time.
template <class L>
struct BoxLanes {
  using Float = typename L::Float;
  const PlacedBox& box;
  const float* rows;
  int count;
  Float d[3], half[3], along[3], r[3][3], abs_r[3][3];

  /// `first`: the first row from the first lane on; `n` values a row.
  BoxLanes(const PlacedBox& b, const float* first, int n) : box(b), rows(first), count(n) {
    for (int c = 0; c < 3; ++c) {
      d[c] = L::subtract(row(box_row::centre + c), L::broadcast(box.centre[c]));
      half[c] = row(box_row::half + c);
    }
  }

  Float row(int index) const { return L::load(rows + index * count); }
  Float axis(int j, int c) const { return row(box_row::axis + 3 * j + c); }

  void project(int i) {
    along[i] = along_axis<L>(box.axis[i], d);
    for (int j = 0; j < 3; ++j) {
      const Float axis_j[3] = {axis(j, 0), axis(j, 1), axis(j, 2)};
      r[i][j] = along_axis<L>(box.axis[i], axis_j);
      abs_r[i][j] = L::abs(r[i][j]);
    }
  }
  /// Lanes that the placed box's axis i separates; after project(i).
  unsigned apart_on_placed(int i) const {
    Float reach = L::multiply_add(half[0], abs_r[i][0], L::broadcast(box.half[i]));
    reach = L::multiply_add(half[1], abs_r[i][1], reach);
    reach = L::multiply_add(half[2], abs_r[i][2], reach);
    return L::bits(L::greater(L::abs(along[i]), reach));
  }
  /// Lanes that their own axis j separates; after all three project.
  unsigned apart_on_lane(int j) const {
    Float at = L::multiply(d[0], axis(j, 0));
    at = L::multiply_add(d[1], axis(j, 1), at);
    at = L::multiply_add(d[2], axis(j, 2), at);
    Float reach = L::multiply_add(L::broadcast(box.half[0]), abs_r[0][j], half[j]);
    reach = L::multiply_add(L::broadcast(box.half[1]), abs_r[1][j], reach);
    reach = L::multiply_add(L::broadcast(box.half[2]), abs_r[2][j], reach);
    return L::bits(L::greater(L::abs(at), reach));
  }
  /// Lanes that the cross product of axes i and j separates. Where the two are parallel both sides are rounding
  /// errors, which the margin exceeds.
  unsigned apart_on_cross(int i, int j, float margin_m) const {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    const Float at = L::multiply_subtract(along[i2], r[i1][j], L::multiply(along[i1], r[i2][j]));
    Float reach = L::multiply_add(L::broadcast(box.half[i1]), abs_r[i2][j], L::broadcast(margin_m));
    reach = L::multiply_add(L::broadcast(box.half[i2]), abs_r[i1][j], reach);
    reach = L::multiply_add(half[j1], abs_r[i][j2], reach);
    reach = L::multiply_add(half[j2], abs_r[i][j1], reach);
    return L::bits(L::greater(L::abs(at), reach));
  }
};

template <class L>
unsigned overlapped_boxes(const PlacedBox& box, const float* rows, int count, unsigned alive, float margin_m,
                          TraversalCounts& counts) {
  BoxLanes<L> lanes(box, rows, count);
  lanes.project(0);
  ++counts.axis_tests;
  alive &= ~lanes.apart_on_placed(0);
  if (!alive) return 0;
  lanes.project(1);
  lanes.project(2);
  counts.axis_tests += 5;
  alive &= ~(lanes.apart_on_placed(1) | lanes.apart_on_placed(2));
  alive &= ~(lanes.apart_on_lane(0) | lanes.apart_on_lane(1) | lanes.apart_on_lane(2));
  for (int i = 0; i < 3 && alive; ++i) {
    counts.axis_tests += 3;
    for (int j = 0; j < 3; ++j) alive &= ~lanes.apart_on_cross(i, j, margin_m);
  }
  return alive;
}

template <class L>
unsigned box_vs_children(const BvhNode& a, const BvhView& to, const BvhNode& b, const FrameChange& change,
                         float margin_m, unsigned wanted, TraversalCounts& counts) {
  const PlacedBox box = place_box(a, b, change, margin_m);
  const float* rows = to.boxes + box_rows * std::size_t{b.first};
  unsigned alive = 0;
  for (int l = 0; l < b.count; l += L::width) {
    const unsigned here = wanted >> l & ((1u << L::width) - 1);
    if (here) alive |= overlapped_boxes<L>(box, rows + l, b.count, here, margin_m, counts) << l;
  }
  return alive;
}

template <class L, class Slab>
unsigned children_in_reach(const TraversalQuery& q, const BvhView& from, std::uint32_t a, const BvhView& to,
                           std::uint32_t b, const FrameChange& change) {
  alignas(64) float threshold[32];
  const BvhNode &na = from.nodes[a], &nb = to.nodes[b];
  // Near the leaves boxes are the thinner volumes, above them k-DOPs: the likelier test to end it all comes first.
  unsigned children = (1u << nb.count) - 1;
  const bool boxes_first = nb.above_leaves;
  if (boxes_first) children = box_vs_children<L>(na, to, nb, change, q.pose->margin_m, children, *q.counts);
  if (!children) return 0;
  realign<L>(own_slabs<Slab>(from, a), na, nb, change, *q.pose->orientations, q.pose->margin_m, to.stride, threshold);
  children &= overlapped_children<L, Slab>(to, nb, threshold, children, *q.counts);
  if (boxes_first || !children) return children;
  return box_vs_children<L>(na, to, nb, change, q.pose->margin_m, children, *q.counts);
}

template <class L, class Slab>
void hybrid(const TraversalQuery& q) {
  const RelativePose& pose = *q.pose;
  traverse_from_roots<L>(q, [&](std::uint32_t a, std::uint32_t b, std::size_t waiting) {
    const BvhNode &na = q.a.nodes[a], &nb = q.b.nodes[b];
    if (descends_into_b(na, nb)) {
      const unsigned children = children_in_reach<L, Slab>(q, q.a, a, q.b, b, pose.a_to_b);
      return push_children(q.stack, waiting, children, pair_of(a, nb.first), 1);
    }
    const unsigned children = children_in_reach<L, Slab>(q, q.b, b, q.a, a, pose.b_to_a);
    return push_children(q.stack, waiting, children, pair_of(na.first, b), std::uint64_t{1} << 32);
  });
}

template <class L>
void traverse_hybrid(const TraversalQuery& q) {
  q.a.slabs_f16.own ? hybrid<L, std::uint16_t>(q) : hybrid<L, float>(q);
}
