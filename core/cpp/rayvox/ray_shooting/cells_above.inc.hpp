// Included once per instruction set, inside its namespace, after its Lanes.

// A bit for each of an octant's 64 log-odds above the bound.
template <class L>
static std::uint64_t cells_above(const float* log_odds, float bound) {
  std::uint64_t above = 0;
  for (int first = 0; first < 64; first += L::width) {
    const unsigned below = L::bits(L::less_equal(L::load(log_odds + first), L::broadcast(bound)));
    constexpr auto all = static_cast<unsigned>((std::uint64_t{1} << L::width) - 1);
    above |= static_cast<std::uint64_t>(~below & all) << first;
  }
  return above;
}
