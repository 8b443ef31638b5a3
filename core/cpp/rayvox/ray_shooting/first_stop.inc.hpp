// Where is a ray stopped first? (Amanatides and Woo 1987, in strides over a StopTree's empty blocks.) Included once per
// instruction set, inside its namespace.
//
// Every crossing is computed from the border itself, with four roundings of 2^-53. Where two crossings come closer than
// that tells apart, or a place closer to a border than 2^-24 cells (it errs by less than 2^-28, for coordinates stay
// below 2^21), the ray is left to exact arithmetic (cast_ray.cpp): never a wrong answer, hardly ever none.

constexpr double crossing_margin = 0x1p-49, place_margin = 0x1p-24;

// Morton code of a cell in a 4x4x4 block, from the two lowest bits of each coordinate at `shift`.
inline std::uint32_t child_at(const std::uint32_t (&at)[3], int shift) {
  constexpr std::uint32_t spread[4] = {0, 1, 8, 9};
  return spread[at[0] >> shift & 3] | spread[at[1] >> shift & 3] << 1 | spread[at[2] >> shift & 3] << 2;
}

// Descends the tree for one cell after another, from where two cells' paths part.
struct StopSearch {
  const StopTree& tree;
  const StopNode* path[StopTree::max_levels / 2 + 1];  // by half the level
  std::uint64_t cells = 0;                             // of level 2
  std::uint32_t last[3] = {0, 0, 0};
  int lowest;  // half the level of the lowest node on the path

  explicit StopSearch(const StopTree& t) : tree(t), lowest(t.root_level / 2) { path[lowest] = &t.root; }

  // The level of the block around the cell that nothing stops in, -1 if the cell itself stops rays.
  int free_level(const std::int32_t (&cell)[3]) {
    std::uint32_t at[3], differing = 0;
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = static_cast<std::uint32_t>(cell[axis] + tree.half_extent);
      differing |= at[axis] ^ last[axis];
      last[axis] = at[axis];
    }
    while (lowest < tree.root_level / 2 && differing >> (2 * lowest)) ++lowest;
    for (; lowest > 1; --lowest) {
      const StopNode& node = *path[lowest];
      const std::uint32_t child = child_at(at, 2 * lowest - 2);
      const std::uint64_t bit = std::uint64_t{1} << child;
      if (node.full & bit) return -1;
      if (!(node.mixed & bit)) return empty_level(node.full | node.mixed, child, 2 * lowest - 2);
      const std::uint32_t index =
          node.first_child + static_cast<std::uint32_t>(__builtin_popcountll(node.mixed & (bit - 1)));
      if (lowest > 2) {
        path[lowest - 1] = tree.nodes + index;
      } else {
        cells = tree.cells[index];
      }
    }
    const std::uint32_t child = child_at(at, 0);
    return cells >> child & 1 ? -1 : empty_level(cells, child, 0);
  }

  // Eight children in a row are one of the octree's.
  static int empty_level(std::uint64_t taken, std::uint32_t child, int level) {
    return (taken >> (child & 56) & 0xff) == 0 ? level + 1 : level;
  }
};

inline std::int32_t floor_of(double u) {
  const auto truncated = static_cast<std::int32_t>(u);
  return truncated - (u < truncated);
}

inline void find_first_stop(const StopTree& tree, StopQuery& query) {
  double direction[3], inverse[3];
  std::int32_t cell[3], end[3], upwards[3];
  for (int axis = 0; axis < 3; ++axis) {
    direction[axis] = query.end[axis] - query.origin[axis];
    inverse[axis] = 1 / direction[axis];
    upwards[axis] = direction[axis] >= 0;
    cell[axis] = floor_of(query.origin[axis]);
    end[axis] = floor_of(query.end[axis]);
  }
  StopSearch search(tree);
  int crossed = -1;
  double crossed_border = 0;
  query.answer = StopQuery::undecided;
  for (;;) {
    const int level = search.free_level(cell);
    if (level < 0) break;
    if (((cell[0] ^ end[0]) >> level | (cell[1] ^ end[1]) >> level | (cell[2] ^ end[2]) >> level) == 0) {
      query.answer = StopQuery::passes;
      return;
    }
    // An axis that crosses no border before the end meets its next one at the end at the earliest.
    double t[3];
    std::int32_t border[3];
    for (int axis = 0; axis < 3; ++axis) {
      border[axis] = ((cell[axis] >> level) + upwards[axis]) * (std::int32_t{1} << level);
      t[axis] = (border[axis] - query.origin[axis]) * inverse[axis];
    }
    const double least_xy = t[1] < t[0] ? t[1] : t[0], most_xy = t[1] < t[0] ? t[0] : t[1];
    const double first = t[2] < least_xy ? t[2] : least_xy;
    const double second = t[2] < least_xy ? least_xy : t[2] < most_xy ? t[2] : most_xy;
    if (!(second - first > crossing_margin * first)) return;
    crossed = t[2] < least_xy ? 2 : t[1] < t[0] ? 1 : 0;
    crossed_border = border[crossed];
    bool doubtful = false;
    for (int axis = 0; axis < 3; ++axis) {
      const double place = query.origin[axis] + direction[axis] * first;
      const std::int32_t found = floor_of(place);
      const double part = place - found;
      doubtful |= axis != crossed && direction[axis] != 0 && (part < place_margin || part > 1 - place_margin);
      cell[axis] = axis == crossed ? border[axis] - 1 + upwards[axis] : found;
    }
    if (doubtful) return;
  }
  query.answer = StopQuery::stopped;
  query.t = crossed < 0 ? 0 : (crossed_border - query.origin[crossed]) / direction[crossed];
  for (int axis = 0; axis < 3; ++axis) query.cell[axis] = cell[axis];
}

inline void find_first_stops(const StopTree& tree, StopQuery* queries, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) find_first_stop(tree, queries[i]);
}
