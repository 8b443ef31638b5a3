// Tests of k-DOPs against each other (SIMDop, Sec. IV-B), the one re-enclosed in the other's axes.

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
