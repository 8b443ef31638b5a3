// Hybrid traversal: pairs of nodes wait untested; as many as there are lanes are taken from the stack and their
// oriented boxes tested at once (the separating axis test of Gottschalk, Lin and Manocha, "OBBTree", 1996), then the
// k-DOPs of those left, one pair after the other and all orientations at once. Lanes are full however few children
// nodes have, and what a pair will read is known when it is pushed, so that memory has time.

/// The boxes of L::width nodes: coordinates of their centres and axes, and half extents.
template <class L>
struct BoxLanes {
  using Float = typename L::Float;
  Float centre[3], axis[3][3], half[3];

  explicit BoxLanes(const float* const* nodes) {
    Float row[3][4];
    for (int i = 0; i < 3; ++i) L::load_transposed(nodes, 4 * i, row[i]);
    for (int i = 0; i < 12; ++i) {
      const Float value = row[i / 4][i % 4];
      if (i < 3)
        centre[i] = value;
      else if (i < 9)
        axis[(i - 3) / 3][i % 3] = value;
      else
        half[i - 9] = value;
    }
  }
  void find_third_axis() { cross<L>(axis[0], axis[1], axis[2]); }
};

template <class L>
void turn(const float* rotation, const typename L::Float* v, typename L::Float* out) {
  for (int i = 0; i < 3; ++i) {
    const float* r = rotation + 3 * i;
    const auto xy = L::multiply_add(L::broadcast(r[1]), v[1], L::multiply(L::broadcast(r[0]), v[0]));
    out[i] = L::multiply_add(L::broadcast(r[2]), v[2], xy);
  }
}

/// L::width pairs of boxes in b's frame, seen along their axes. a's half extents are widened by the margin.
template <class L>
struct BoxPairLanes {
  using Float = typename L::Float;
  BoxLanes<L> a, b;
  Float margin, d[3];                    // between the centres
  Float along[3], r[3][3], abs_r[3][3];  // d and b's axes along a's axes

  BoxPairLanes(const float* const* nodes_a, const float* const* nodes_b, const FrameChange& a_to_b, float margin_m)
      : a(nodes_a), b(nodes_b), margin(L::broadcast(margin_m)) {
    Float turned[3];
    turn<L>(a_to_b.rotation_f32, a.centre, turned);
    for (int c = 0; c < 3; ++c) {
      const Float t = L::broadcast(a_to_b.translation_f32[c]);
      d[c] = L::subtract(b.centre[c], L::add(turned[c], t));
      a.half[c] = L::add(a.half[c], margin);
    }
    for (int i = 0; i < 2; ++i) {
      turn<L>(a_to_b.rotation_f32, a.axis[i], turned);
      for (int c = 0; c < 3; ++c) a.axis[i][c] = turned[c];
    }
    a.find_third_axis();
    b.find_third_axis();
    for (int i = 0; i < 3; ++i) {
      along[i] = dot<L>(a.axis[i], d);
      for (int j = 0; j < 3; ++j) abs_r[i][j] = L::abs(r[i][j] = dot<L>(a.axis[i], b.axis[j]));
    }
  }

  /// Lanes that a's axis i separates.
  unsigned apart_on_a(int i) const {
    Float reach = L::multiply_add(b.half[0], abs_r[i][0], a.half[i]);
    reach = L::multiply_add(b.half[1], abs_r[i][1], reach);
    reach = L::multiply_add(b.half[2], abs_r[i][2], reach);
    return L::bits(L::greater(L::abs(along[i]), reach));
  }
  unsigned apart_on_b(int j) const {
    Float reach = L::multiply_add(a.half[0], abs_r[0][j], b.half[j]);
    reach = L::multiply_add(a.half[1], abs_r[1][j], reach);
    reach = L::multiply_add(a.half[2], abs_r[2][j], reach);
    return L::bits(L::greater(L::abs(dot<L>(b.axis[j], d)), reach));
  }
  /// Lanes that the cross product of axes i and j separates. Where the two are parallel both sides are rounding
  /// errors, which the margin exceeds.
  unsigned apart_on_cross(int i, int j) const {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    const Float at = L::multiply_subtract(along[i2], r[i1][j], L::multiply(along[i1], r[i2][j]));
    Float reach = L::multiply_add(a.half[i1], abs_r[i2][j], margin);
    reach = L::multiply_add(a.half[i2], abs_r[i1][j], reach);
    reach = L::multiply_add(b.half[j1], abs_r[i][j2], reach);
    reach = L::multiply_add(b.half[j2], abs_r[i][j1], reach);
    return L::bits(L::greater(L::abs(at), reach));
  }
};

/// Pairs taken from the stack: `count` of them, beyond which the lanes hold pairs that were looked at before.
template <class L>
struct PairBatch {
  std::uint64_t pair[L::width];
  int count;

  std::uint32_t a(int lane) const { return static_cast<std::uint32_t>(pair[lane] >> 32); }
  std::uint32_t b(int lane) const { return static_cast<std::uint32_t>(pair[lane]); }
};

/// The pairs whose boxes overlap.
template <class L>
unsigned overlapped_boxes(const TraversalQuery& q, const PairBatch<L>& batch) {
  const float *nodes_a[L::width], *nodes_b[L::width];
  for (int l = 0; l < L::width; ++l) nodes_a[l] = q.a.nodes[batch.a(l)].origin;
  for (int l = 0; l < L::width; ++l) nodes_b[l] = q.b.nodes[batch.b(l)].origin;
  q.counts->node_pairs += static_cast<unsigned>(batch.count);
  q.counts->axis_tests += 6;
  const BoxPairLanes<L> boxes(nodes_a, nodes_b, q.pose->a_to_b, q.pose->margin_m);
  unsigned alive = (1u << batch.count) - 1;
  for (int i = 0; i < 3; ++i) alive &= ~(boxes.apart_on_a(i) | boxes.apart_on_b(i));
  if (!alive) return 0;
  q.counts->axis_tests += 9;
  for (int k = 0; k < 9; ++k) alive &= ~boxes.apart_on_cross(k / 3, k % 3);
  return alive;
}

/// Those of the pairs `alive` whose k-DOPs overlap: b's re-enclosed in a's axes.
template <class L, int stride>
unsigned overlapped_kdops(const TraversalQuery& q, const PairBatch<L>& batch, unsigned alive) {
  const std::int16_t *of_a = q.a.slabs_i16.own, *of_b = q.b.slabs_i16.own;
  const KdopAlignment& align = q.pose->kdop;
  unsigned overlapped = 0;
  for (unsigned left = alive; left; left &= left - 1) {
    const int lane = __builtin_ctz(left);
    const std::int16_t* a = of_a + std::size_t{batch.a(lane)} * stride;
    const typename L::template Table<stride> table(of_b + std::size_t{batch.b(lane)} * stride);
    auto reached = L::first(L::width);
    for (int i = 0; i < stride; i += L::width) {
      auto least = L::load(align.base + i);
      for (int j = 0; j < 3; ++j) {
        least = L::multiply_add(L::load(align.coefficient[j] + i), table.lookup(align.index[j] + i), least);
      }
      reached = L::both(reached, L::not_less(L::load(a + i), least));
    }
    overlapped |= static_cast<unsigned>(L::bits(reached) == (1u << L::width) - 1) << lane;
  }
  q.counts->axis_tests += static_cast<unsigned>(__builtin_popcount(alive) * q.a.axis_count);
  return overlapped;
}

inline void prefetch_slabs(const BvhView& v, std::uint32_t node) {
  __builtin_prefetch(v.slabs_i16.own + std::size_t{node} * static_cast<unsigned>(v.stride));
}

inline void prefetch_triangles(const BvhView& v, const BvhNode& leaf) {
  const float* vertices = v.leaf_vertices + 9 * std::size_t{leaf.first};
  for (int i = 0; i < 9 * leaf.count + 15; i += 16) __builtin_prefetch(vertices + i);
}

template <class L, int stride>
class HybridTraversal {
 public:
  explicit HybridTraversal(const TraversalQuery& q) : q_(q) {}

  void run() {
    q_.stack[waiting_++] = 0;
    while (waiting_ > 0) {
      const PairBatch<L> batch = take();
      const unsigned near = overlapped_boxes<L>(q_, batch);
      for (unsigned left = near; left; left &= left - 1) {
        prefetch_slabs(q_.a, batch.a(__builtin_ctz(left)));
        prefetch_slabs(q_.b, batch.b(__builtin_ctz(left)));
      }
      // Meanwhile the triangles of the last batch's pairs of leaves have come.
      if (settle_leaves()) return;
      for (unsigned left = overlapped_kdops<L, stride>(q_, batch, near); left; left &= left - 1) {
        open(batch.pair[__builtin_ctz(left)]);
      }
    }
    settle_leaves();
  }

 private:
  PairBatch<L> take() {
    PairBatch<L> batch;
    batch.count = waiting_ < L::width ? static_cast<int>(waiting_) : L::width;
    waiting_ -= static_cast<std::size_t>(batch.count);
    for (int l = 0; l < L::width; ++l) batch.pair[l] = q_.stack[waiting_ + static_cast<unsigned>(l)];
    return batch;
  }

  // The larger of the two is opened.
  void open(std::uint64_t pair) {
    const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
    const BvhNode &na = q_.a.nodes[a], &nb = q_.b.nodes[b];
    if (na.is_leaf && nb.is_leaf) {
      prefetch_triangles(q_.a, na);
      prefetch_triangles(q_.b, nb);
      leaves_[leaf_count_++] = pair;
      return;
    }
    const bool into_b = descends_into_b(na, nb);
    const BvhNode* children = into_b ? q_.b.nodes + nb.first : q_.a.nodes + na.first;
    const unsigned count = into_b ? nb.count : na.count;
    std::uint64_t next = into_b ? pair_of(a, nb.first) : pair_of(na.first, b);
    const std::uint64_t step = into_b ? 1 : std::uint64_t{1} << 32;
    for (unsigned i = 0; i < count; ++i, next += step) {
      __builtin_prefetch(children + i);
      q_.stack[waiting_ + i] = next;
    }
    waiting_ += count;
  }

  bool settle_leaves() {
    for (int i = 0; i < leaf_count_; ++i) {
      const auto a = static_cast<std::uint32_t>(leaves_[i] >> 32), b = static_cast<std::uint32_t>(leaves_[i]);
      if (leaf_pair<L>(q_, q_.a.nodes[a], q_.b.nodes[b])) return true;
    }
    leaf_count_ = 0;
    return false;
  }

  const TraversalQuery& q_;
  std::size_t waiting_ = 0;
  std::uint64_t leaves_[L::width];
  int leaf_count_ = 0;
};

template <class L>
void traverse_hybrid(const TraversalQuery& q) {
  q.a.stride == 16 ? HybridTraversal<L, 16>(q).run() : HybridTraversal<L, 32>(q).run();
}
