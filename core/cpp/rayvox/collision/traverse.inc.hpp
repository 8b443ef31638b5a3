// Simultaneous traversals of two hierarchies (SIMDop, Algorithm 1 and Sec. IV-B). Pairs of nodes whose volumes overlap
// wait on a stack. Depth first, so it stays small; a pair that is two leaves is settled at once.

inline std::uint64_t pair_of(std::uint32_t a, std::uint32_t b) { return static_cast<std::uint64_t>(a) << 32 | b; }

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

/// Depth first from the roots. `expand` pushes what follows from a pair that is not two leaves.
template <class L, class Expand>
void traverse_from_roots(const TraversalQuery& q, const Expand& expand) {
  std::size_t waiting = 1;
  q.stack[0] = 0;
  while (waiting > 0) {
    const std::uint64_t pair = q.stack[--waiting];
    const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
    const BvhNode &na = q.a.nodes[a], &nb = q.b.nodes[b];
    if (na.is_leaf && nb.is_leaf) {
      if (leaf_pair<L>(q, na, nb)) return;
    } else {
      waiting = expand(a, b, waiting);
    }
  }
}

// The larger of the two is opened: its children against the other, all at once.
template <class L, class Slab>
void one_vs_sixteen(const TraversalQuery& q) {
  if (!overlap_by_orientation<L, Slab>(q, 0, 0)) return;
  traverse_from_roots<L>(q, [&](std::uint32_t a, std::uint32_t b, std::size_t waiting) {
    return test_one_side<L, Slab>(q, a, b, descends_into_b(q.a.nodes[a], q.b.nodes[b]), waiting);
  });
}

template <class L, class Slab>
void four_vs_four(const TraversalQuery& q) {
  if (!overlap_by_orientation<L, Slab>(q, 0, 0)) return;
  traverse_from_roots<L>(q, [&](std::uint32_t a, std::uint32_t b, std::size_t waiting) {
    const BvhNode &na = q.a.nodes[a], &nb = q.b.nodes[b];
    if (na.is_leaf || nb.is_leaf) return test_one_side<L, Slab>(q, a, b, na.is_leaf, waiting);
    for (unsigned pairs = overlapped_pairs<L, Slab>(q, na, nb); pairs; pairs &= pairs - 1) {
      const auto at = static_cast<std::uint32_t>(__builtin_ctz(pairs));
      q.stack[waiting++] = pair_of(na.first + at / 4, nb.first + at % 4);
    }
    return waiting;
  });
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
