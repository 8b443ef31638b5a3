// Simultaneous traversals of two hierarchies (SIMDop, Algorithm 1 and Sec. IV-B). Pairs of nodes whose volumes overlap
// wait on a stack. Depth first, so it stays small; a pair that is two leaves is settled at once.

inline std::uint64_t pair_of(std::uint32_t a, std::uint32_t b) { return static_cast<std::uint64_t>(a) << 32 | b; }

template <class Slab>
const SlabArrays<Slab>& slabs_of(const BvhView& v);
template <>
[[maybe_unused]] inline const SlabArrays<float>& slabs_of<float>(const BvhView& v) {
  return v.slabs_f32;
}
template <>
[[maybe_unused]] inline const SlabArrays<std::uint16_t>& slabs_of<std::uint16_t>(const BvhView& v) {
  return v.slabs_f16;
}

template <class Slab>
const Slab* own_slabs(const BvhView& v, std::uint32_t node) {
  return slabs_of<Slab>(v).own + std::size_t{node} * static_cast<std::size_t>(v.stride);
}

template <class Slab>
const Slab* child_slabs(const BvhView& v, const BvhNode& node) {
  return slabs_of<Slab>(v).child + std::size_t{node.first} * static_cast<std::size_t>(2 * v.axis_count);
}

/// One pair of k-DOPs, one orientation after the other; b's is re-enclosed as far as it is looked at.
template <class Slab>
bool overlap_scalar(const TraversalQuery& q, std::uint32_t a, std::uint32_t b) {
  using L = CollisionLanes;
  const BvhNode &na = q.a.nodes[a], &nb = q.b.nodes[b];
  const FrameChange& change = q.pose->b_to_a;
  const Slab *from = own_slabs<Slab>(q.b, b), *own = own_slabs<Slab>(q.a, a);
  const Offset d = offset_between(nb, na, change);
  const auto value = [](const Slab* p) {
    if constexpr (sizeof(Slab) == 4)
      return *p;
    else
      return L::half_value(*p);
  };
  const auto reaches = [&](int o, float moved) {
    float sum = 0;
    for (int j = 0; j < 3; ++j) sum += change.coefficient[j][o] * value(from + change.index[j][o]);
    return value(own + o) * na.slab_unit >= moved - q.pose->margin_m - sum * nb.slab_unit;
  };
  ++q.counts->node_pairs;
  const auto& rows = q.pose->orientations->coordinate;
  for (int i = 0; i < q.a.axis_count; ++i) {
    ++q.counts->axis_tests;
    const float moved = rows[0][i] * d.x + rows[1][i] * d.y + rows[2][i] * d.z;
    if (!reaches(i, moved) || !reaches(q.a.stride / 2 + i, -moved)) return false;
  }
  return true;
}

/// One pair of k-DOPs, L::width orientations at a time.
template <class L, class Slab>
bool overlap_by_orientation(const TraversalQuery& q, std::uint32_t a, std::uint32_t b) {
  alignas(64) float threshold[32];
  realign<L>(own_slabs<Slab>(q.b, b), q.b.nodes[b], q.a.nodes[a], q.pose->b_to_a, *q.pose->orientations,
             q.pose->margin_m, q.a.stride, threshold);
  const Slab* own = own_slabs<Slab>(q.a, a);
  ++q.counts->node_pairs;
  const int half = q.a.stride / 2;
  for (int i = 0; i < q.a.stride; i += L::width) {
    if (i % half == 0 || L::width > half) q.counts->axis_tests += static_cast<unsigned>(q.a.axis_count) / 2;
    // Rows beyond the last axis are zero on both sides.
    const unsigned reached = L::bits(L::not_less(L::load(own + i), L::load(threshold + i)));
    if (reached != (1u << L::width) - 1) return false;
  }
  return true;
}

/// One k-DOP against the children of `node` (Algorithm 2): those of the children `alive` that it overlaps.
template <class L, class Slab>
unsigned overlapped_children(const BvhView& v, const BvhNode& node, const float* threshold, unsigned alive,
                             TraversalCounts& counts) {
  const Slab* block = child_slabs<Slab>(v, node);
  const int half = v.stride / 2;
  counts.node_pairs += node.count;
  // Looking whether any child is left costs as much as an axis, so four axes go at once.
  for (int i = 0; i < v.axis_count && alive; i += 4) {
    const int end = i + 4 < v.axis_count ? i + 4 : v.axis_count;
    counts.axis_tests += static_cast<unsigned>(end - i);
    unsigned reached = 0;
    for (int l = 0; l < node.count; l += L::width) {
      auto overlap = L::first(L::width);
      for (int axis = i; axis < end; ++axis) {
        const Slab* row = block + 2 * axis * node.count + l;
        overlap = L::both(overlap, L::not_less(L::load(row), L::broadcast(threshold[axis])));
        overlap = L::both(overlap, L::not_less(L::load(row + node.count), L::broadcast(threshold[half + axis])));
      }
      reached |= L::bits(overlap) << l;
    }
    alive &= reached;
  }
  return alive;
}

/// Four children of `a` against four of `b` (Algorithm 3, with the permutation of Fig. 4): bit 4 i + j for a's child i
/// and b's child j.
template <class L, class Slab>
unsigned overlapped_pairs(const TraversalQuery& q, const BvhNode& a, const BvhNode& b) {
  const FrameChange& change = q.pose->b_to_a;
  const Slab *of_a = child_slabs<Slab>(q.a, a), *of_b = child_slabs<Slab>(q.b, b);
  const Offset d = offset_between(b, a, change);
  const float per_unit = 1 / a.slab_unit, scale = -b.slab_unit * per_unit;
  const auto& rows = q.pose->orientations->coordinate;
  unsigned alive = ((1u << b.count) - 1) * 0x1111u & ((1u << 4 * a.count) - 1);
  q.counts->node_pairs += static_cast<unsigned>(a.count * b.count);
  for (int i = 0; i < q.a.axis_count && alive; ++i) {
    ++q.counts->axis_tests;
    const float moved = rows[0][i] * d.x + rows[1][i] * d.y + rows[2][i] * d.z;
    typename L::Four side[2], threshold[2];
    for (int s = 0; s < 2; ++s) {
      const int o = s * (q.a.stride / 2) + i;
      const auto term = [&](int j) { return L::load_four(of_b + b.count * change.block_row[j][o]); };
      auto sum = L::multiply_add(change.coefficient[0][o], term(0), L::broadcast_four(0.0f));
      sum = L::multiply_add(change.coefficient[1][o], term(1), sum);
      sum = L::multiply_add(change.coefficient[2][o], term(2), sum);
      const float base = ((s == 0 ? moved : -moved) - q.pose->margin_m) * per_unit;
      threshold[s] = L::multiply_add(scale, sum, L::broadcast_four(base));
      side[s] = L::load_four(of_a + a.count * (2 * i + s));
    }
    unsigned reached = 0;
    for (int block = 0; block < 16 / L::width; ++block) {
      const auto both = L::both(L::not_less(L::spread(side[0], block), L::repeat(threshold[0], block)),
                                L::not_less(L::spread(side[1], block), L::repeat(threshold[1], block)));
      reached |= L::bits(both) << (block * L::width);
    }
    alive &= reached;
  }
  return alive;
}

// Algorithm 1 for a test of single pairs, for any branching factor.
template <class L, class Test>
void traverse_pairs(const TraversalQuery& q, const Test& overlap) {
  std::size_t waiting = 0;
  if (overlap(0u, 0u)) q.stack[waiting++] = 0;
  while (waiting > 0) {
    const std::uint64_t pair = q.stack[--waiting];
    const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
    const BvhNode &na = q.a.nodes[a], &nb = q.b.nodes[b];
    if (na.is_leaf && nb.is_leaf) {
      if (leaf_pair<L>(q, na, nb)) return;
      continue;
    }
    const std::uint32_t first_a = na.is_leaf ? a : na.first, count_a = na.is_leaf ? 1 : na.count;
    const std::uint32_t first_b = nb.is_leaf ? b : nb.first, count_b = nb.is_leaf ? 1 : nb.count;
    for (std::uint32_t i = 0; i < count_a; ++i) {
      for (std::uint32_t j = 0; j < count_b; ++j) {
        if (overlap(first_a + i, first_b + j)) q.stack[waiting++] = pair_of(first_a + i, first_b + j);
      }
    }
  }
}

inline bool descends_into_b(const BvhNode& a, const BvhNode& b) {
  return !b.is_leaf && (a.is_leaf || b.radius >= a.radius);
}

inline std::size_t push_children(std::uint64_t* stack, std::size_t waiting, unsigned children, std::uint64_t first_pair,
                                 std::uint64_t step) {
  for (; children; children &= children - 1) {
    stack[waiting++] = first_pair + static_cast<std::uint64_t>(__builtin_ctz(children)) * step;
  }
  return waiting;
}

template <class L, class Slab>
std::size_t test_one_side(const TraversalQuery& q, std::uint32_t a, std::uint32_t b, bool into_b, std::size_t waiting) {
  alignas(64) float threshold[32];
  const BvhNode &na = q.a.nodes[a], &nb = q.b.nodes[b];
  const RelativePose& pose = *q.pose;
  if (into_b) {
    realign<L>(own_slabs<Slab>(q.a, a), na, nb, pose.a_to_b, *pose.orientations, pose.margin_m, q.a.stride, threshold);
    const unsigned children = overlapped_children<L, Slab>(q.b, nb, threshold, (1u << nb.count) - 1, *q.counts);
    return push_children(q.stack, waiting, children, pair_of(a, nb.first), 1);
  }
  realign<L>(own_slabs<Slab>(q.b, b), nb, na, pose.b_to_a, *pose.orientations, pose.margin_m, q.a.stride, threshold);
  const unsigned children = overlapped_children<L, Slab>(q.a, na, threshold, (1u << na.count) - 1, *q.counts);
  return push_children(q.stack, waiting, children, pair_of(na.first, b), std::uint64_t{1} << 32);
}

// The larger of the two is opened: its children against the other, all at once.
template <class L, class Slab>
void one_vs_sixteen(const TraversalQuery& q) {
  std::size_t waiting = 0;
  if (overlap_by_orientation<L, Slab>(q, 0, 0)) q.stack[waiting++] = 0;
  while (waiting > 0) {
    const std::uint64_t pair = q.stack[--waiting];
    const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
    const BvhNode &na = q.a.nodes[a], &nb = q.b.nodes[b];
    if (na.is_leaf && nb.is_leaf) {
      if (leaf_pair<L>(q, na, nb)) return;
    } else {
      waiting = test_one_side<L, Slab>(q, a, b, descends_into_b(na, nb), waiting);
    }
  }
}

template <class L, class Slab>
void four_vs_four(const TraversalQuery& q) {
  std::size_t waiting = 0;
  if (overlap_by_orientation<L, Slab>(q, 0, 0)) q.stack[waiting++] = 0;
  while (waiting > 0) {
    const std::uint64_t pair = q.stack[--waiting];
    const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
    const BvhNode &na = q.a.nodes[a], &nb = q.b.nodes[b];
    if (na.is_leaf && nb.is_leaf) {
      if (leaf_pair<L>(q, na, nb)) return;
    } else if (na.is_leaf || nb.is_leaf) {
      waiting = test_one_side<L, Slab>(q, a, b, na.is_leaf, waiting);
    } else {
      for (unsigned pairs = overlapped_pairs<L, Slab>(q, na, nb); pairs; pairs &= pairs - 1) {
        const auto at = static_cast<std::uint32_t>(__builtin_ctz(pairs));
        q.stack[waiting++] = pair_of(na.first + at / 4, nb.first + at % 4);
      }
    }
  }
}

inline void traverse_scalar(const TraversalQuery& q) {
  const bool half = q.a.slabs_f16.own != nullptr;
  if (half) {
    traverse_pairs<CollisionLanes>(
        q, [&](std::uint32_t a, std::uint32_t b) { return overlap_scalar<std::uint16_t>(q, a, b); });
  } else {
    traverse_pairs<CollisionLanes>(q, [&](std::uint32_t a, std::uint32_t b) { return overlap_scalar<float>(q, a, b); });
  }
}

template <class L>
void traverse_by_orientation(const TraversalQuery& q) {
  if (q.a.slabs_f16.own) {
    traverse_pairs<L>(
        q, [&](std::uint32_t a, std::uint32_t b) { return overlap_by_orientation<L, std::uint16_t>(q, a, b); });
  } else {
    traverse_pairs<L>(q, [&](std::uint32_t a, std::uint32_t b) { return overlap_by_orientation<L, float>(q, a, b); });
  }
}

template <class L>
void traverse_one_vs_sixteen(const TraversalQuery& q) {
  q.a.slabs_f16.own ? one_vs_sixteen<L, std::uint16_t>(q) : one_vs_sixteen<L, float>(q);
}

template <class L>
void traverse_four_vs_four(const TraversalQuery& q) {
  q.a.slabs_f16.own ? four_vs_four<L, std::uint16_t>(q) : four_vs_four<L, float>(q);
}
