// Batch Neural Gas (SIMDop, Sec. IV-A.3; Weller et al. 2014), prototypes or items side by side. No product is fused
// with a sum, so that every instruction set builds the same hierarchy.

template <class L>
typename L::Float squared_distance(const typename L::Float* a, const typename L::Float* b) {
  typename L::Float square[3];
  for (int c = 0; c < 3; ++c) {
    const auto d = L::subtract(a[c], b[c]);
    square[c] = L::multiply(d, d);
  }
  return L::add(L::add(square[0], square[1]), square[2]);
}

/// How many prototypes are nearer to a sample than prototypes l to l + L::width; of two as near, the one before.
template <class L>
typename L::Float ranks(const float* squared, int count, int l) {
  alignas(64) constexpr float number[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const auto own = L::load(squared + l), own_number = L::load(number + l);
  const auto one = L::broadcast(1.0f), zero = L::broadcast(0.0f);
  auto rank = zero;
  for (int j = 0; j < count; ++j) {
    const auto other = L::broadcast(squared[j]);
    const auto before = L::both(L::not_less(own, other), L::greater(own_number, L::broadcast(number[j])));
    rank = L::add(rank, L::select(L::either(L::greater(own, other), before), one, zero));
  }
  return rank;
}

/// One batch: moves every prototype to the mean of `samples` of the items, weighted by its rank for each.
template <class L>
void adapt_prototypes(GasPrototypes& gas, const PartitionItem* items, std::size_t item_count, std::size_t samples,
                      const float* weight_of_rank) {
  alignas(64) float sum[3][16] = {}, total[16] = {}, squared[16] = {}, rank[16] = {};
  for (std::size_t s = 0; s < samples; ++s) {
    const float* centre = items[s * item_count / samples].centre;
    const typename L::Float at[3] = {L::broadcast(centre[0]), L::broadcast(centre[1]), L::broadcast(centre[2])};
    for (int l = 0; l < gas.count; l += L::width) {
      const typename L::Float prototype[3] = {L::load(gas.at[0] + l), L::load(gas.at[1] + l), L::load(gas.at[2] + l)};
      L::store(squared + l, squared_distance<L>(prototype, at));
    }
    for (int l = 0; l < gas.count; l += L::width) L::store(rank + l, ranks<L>(squared, gas.count, l));
    alignas(64) std::int32_t index[16];
    for (int i = 0; i < 16; ++i) index[i] = static_cast<std::int32_t>(rank[i]);
    for (int l = 0; l < gas.count; l += L::width) {
      const auto weight = L::lookup(weight_of_rank, 16, index + l);
      L::store(total + l, L::add(L::load(total + l), weight));
      for (int c = 0; c < 3; ++c) L::store(sum[c] + l, L::add(L::load(sum[c] + l), L::multiply(weight, at[c])));
    }
  }
  for (int i = 0; i < gas.count; ++i) {
    if (!(total[i] > 1e-20f)) continue;
    for (int c = 0; c < 3; ++c) gas.at[c][i] = sum[c][i] / total[i];
  }
}

/// The prototype nearest to each item; the first of several.
template <class L>
void nearest_prototypes(const GasPrototypes& gas, const PartitionItem* items, std::size_t count,
                        std::uint8_t* nearest) {
  for (std::size_t begin = 0; begin < count; begin += 16) {
    const std::size_t n = count - begin < 16 ? count - begin : 16;
    alignas(64) float centre[3][16] = {}, chosen[16];
    for (std::size_t i = 0; i < n; ++i) {
      for (int c = 0; c < 3; ++c) centre[c][i] = items[begin + i].centre[c];
    }
    for (int l = 0; l < 16; l += L::width) {
      const typename L::Float at[3] = {L::load(centre[0] + l), L::load(centre[1] + l), L::load(centre[2] + l)};
      auto least = L::broadcast(__builtin_inff()), best = L::broadcast(0.0f);
      for (int j = 0; j < gas.count; ++j) {
        const typename L::Float prototype[3] = {L::broadcast(gas.at[0][j]), L::broadcast(gas.at[1][j]),
                                                L::broadcast(gas.at[2][j])};
        const auto squared = squared_distance<L>(prototype, at);
        const auto nearer = L::greater(least, squared);
        least = L::select(nearer, squared, least);
        best = L::select(nearer, L::broadcast(static_cast<float>(j)), best);
      }
      L::store(chosen + l, best);
    }
    for (std::size_t i = 0; i < n; ++i) nearest[begin + i] = static_cast<std::uint8_t>(chosen[i]);
  }
}
