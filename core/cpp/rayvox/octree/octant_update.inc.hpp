// OctoMap's update of one octant's marked cells (AbstractOccupancyOcTree's sensor model: add, clamp; a known cell
// already at the clamping bound is left as it is). Included once per instruction set, inside its namespace, after its
// Lanes.

template <class L>
static OctantOutput update_octant(const OctantInput& in, const UpdateModel& model, float* out) {
  using F = typename L::Float;
  using M = typename L::Mask;
  const F hit = L::broadcast(model.hit), miss = L::broadcast(model.miss);
  const F clamp_min = L::broadcast(model.clamp_min), clamp_max = L::broadcast(model.clamp_max);
  F lowest = L::broadcast(__builtin_inff()), highest = L::broadcast(-__builtin_inff());
  std::uint64_t changed = 0;
  for (int first = 0; first < 64; first += L::width) {
    const M known = L::from_bits(static_cast<unsigned>(in.known >> first));
    const M free = L::from_bits(static_cast<unsigned>(in.free >> first));
    const M occupied = L::from_bits(static_cast<unsigned>(in.occupied >> first));
    const F before = L::load(in.log_odds + first);
    const F added = L::add(before, L::select(occupied, hit, miss));
    const F clamped = L::max(L::min(added, clamp_max), clamp_min);
    const M at_bound = L::either(L::both(occupied, L::less_equal(clamp_max, before)),
                                 L::both(L::invert(occupied), L::less_equal(before, clamp_min)));
    const M touched = L::both(L::either(free, occupied), L::invert(L::both(known, at_bound)));
    const F after = L::select(touched, clamped, before);
    const M known_after = L::either(known, L::either(free, occupied));
    const M differs = L::either(L::invert(known), L::invert(L::equal(after, before)));
    changed |= static_cast<std::uint64_t>(L::bits(L::both(touched, differs))) << first;
    lowest = L::min(lowest, L::select(known_after, after, lowest));
    highest = L::max(highest, L::select(known_after, after, highest));
    L::store(out + first, after);
  }
  return {changed, L::reduce_min(lowest), L::reduce_max(highest)};
}

template <class L>
static void fill_octant(std::uint64_t free, float freed, std::uint64_t occupied, float hit, float* out) {
  using F = typename L::Float;
  const F zero = L::broadcast(0.0f), value_freed = L::broadcast(freed), value_hit = L::broadcast(hit);
  for (int first = 0; first < 64; first += L::width) {
    const F values = L::select(L::from_bits(static_cast<unsigned>(free >> first)), value_freed, zero);
    L::store(out + first, L::select(L::from_bits(static_cast<unsigned>(occupied >> first)), value_hit, values));
  }
}

template <class L>
static std::uint64_t cells_above(const float* log_odds, float bound) {
  std::uint64_t above = 0;
  for (int first = 0; first < 64; first += L::width) {
    above |= static_cast<std::uint64_t>(L::bits(L::less_than(L::broadcast(bound), L::load(log_odds + first)))) << first;
  }
  return above;
}
