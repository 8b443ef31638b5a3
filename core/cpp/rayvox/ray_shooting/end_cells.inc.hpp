// The cells that hold end points, by tile. Plain loops over small blocks, which compilers vectorise. Included once per
// instruction set, inside its namespace, after ray_clip.inc.hpp.

static constexpr int ends_per_block = 64;

static std::size_t find_end_cells(const EndCells& ends) {
  const auto half = static_cast<std::uint32_t>(ends.half_extent), level = static_cast<std::uint32_t>(ends.tile_level);
  const std::uint32_t in_tile = (1u << level) - 1;
  std::uint64_t latest_tile = ~std::uint64_t{0};
  std::uint32_t latest_place = 0;
  std::size_t found = 0;
  for (std::size_t first = 0; first < ends.count; first += ends_per_block) {
    const std::size_t left = ends.count - first;
    const int count = left < ends_per_block ? static_cast<int>(left) : ends_per_block;
    alignas(64) std::uint32_t cell[3][ends_per_block], place[ends_per_block];
    alignas(64) std::uint64_t tile[ends_per_block];
    for (int axis = 0; axis < 3; ++axis) {
      const double* from = ends.end[axis] + first;
      for (int i = 0; i < count; ++i) {
        cell[axis][i] = static_cast<std::uint32_t>(static_cast<std::int32_t>(__builtin_floor(from[i]))) + half;
      }
    }
    for (int i = 0; i < count; ++i) {
      place[i] = spread_six_bits(cell[0][i] & in_tile) | spread_six_bits(cell[1][i] & in_tile) << 1 |
                 spread_six_bits(cell[2][i] & in_tile) << 2;
      tile[i] = std::uint64_t{cell[0][i] >> level} | std::uint64_t{cell[1][i] >> level} << 21 |
                std::uint64_t{cell[2][i] >> level} << 42;
    }
    for (int i = 0; i < count; ++i) {
      const bool differs = (place[i] != latest_place) | (tile[i] != latest_tile);
      const bool counts = ends.marks_end[first + static_cast<std::size_t>(i)] != 0;
      ends.tile[found] = tile[i];
      ends.place[found] = place[i];
      found += counts & differs;
      latest_tile = counts ? tile[i] : latest_tile;
      latest_place = counts ? place[i] : latest_place;
    }
  }
  return found;
}
