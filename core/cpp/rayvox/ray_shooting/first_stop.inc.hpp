// Where is a ray stopped first? (Amanatides and Woo 1987, from child to child of a StopTree's nodes.) Included once per
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

inline std::int32_t floor_of(double u) {
  const auto truncated = static_cast<std::int32_t>(u);
  return truncated - (u < truncated);
}

// The tree's nodes around one cell after another: descended anew from where two cells' paths part.
struct StopPath {
  const StopTree& tree;
  const StopNode* node[StopTree::max_levels / 2 + 1];  // by half the level
  std::uint64_t cells = 0;                             // the node of level 2
  std::uint32_t last[3] = {0, 0, 0};
  int lowest;               // half the level of the lowest node
  std::uint64_t taken = 0;  // its children that stop rays, or may

  explicit StopPath(const StopTree& t) : tree(t), lowest(t.root_level / 2) { node[lowest] = &t.root; }

  // Down to the lowest node kept around the cell; true if its child there stops rays throughout.
  bool stops_in(const std::int32_t (&cell)[3]) {
    std::uint32_t at[3], differing = 0;
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = static_cast<std::uint32_t>(cell[axis] + tree.half_extent);
      differing |= at[axis] ^ last[axis];
      last[axis] = at[axis];
    }
    while (lowest < tree.root_level / 2 && differing >> (2 * lowest)) ++lowest;
    for (; lowest > 1; --lowest) {
      const StopNode& here = *node[lowest];
      const std::uint64_t bit = std::uint64_t{1} << child_at(at, 2 * lowest - 2);
      taken = here.full | here.mixed;
      if (!(here.mixed & bit)) return here.full & bit;
      const std::uint32_t index =
          here.first_child + static_cast<std::uint32_t>(__builtin_popcountll(here.mixed & (bit - 1)));
      if (lowest > 2) {
        node[lowest - 1] = tree.nodes + index;
      } else {
        cells = tree.cells[index];
      }
    }
    taken = cells;
    return cells >> child_at(at, 0) & 1;
  }
};

inline void find_first_stop(const StopTree& tree, StopQuery& query) {
  double direction[3], inverse[3], first = 0;
  std::int32_t cell[3], end[3], upwards[3];
  for (int axis = 0; axis < 3; ++axis) {
    direction[axis] = query.end[axis] - query.origin[axis];
    inverse[axis] = 1 / direction[axis];
    upwards[axis] = direction[axis] >= 0;
    cell[axis] = floor_of(query.origin[axis]);
    end[axis] = floor_of(query.end[axis]);
  }
  StopPath path(tree);
  query.answer = StopQuery::undecided;
  while (!path.stops_in(cell)) {
    // From child to child of this node, until one is taken or the node is left.
    const int level = 2 * path.lowest - 2;
    // Blocks, unlike cells, are counted from the octree's lowest corner, as the node's children are.
    std::uint32_t block[3], last[3];
    std::int32_t border[3];
    double t[3];
    for (int axis = 0; axis < 3; ++axis) {
      block[axis] = path.last[axis] >> level;
      last[axis] = static_cast<std::uint32_t>(end[axis] + tree.half_extent) >> level;
      border[axis] = ((cell[axis] >> level) + upwards[axis]) * (std::int32_t{1} << level);
      t[axis] = (border[axis] - query.origin[axis]) * inverse[axis];
    }
    int crossed;
    for (;;) {
      if (((block[0] ^ last[0]) | (block[1] ^ last[1]) | (block[2] ^ last[2])) == 0) {
        query.answer = StopQuery::passes;
        return;
      }
      // An axis that crosses no border before the end meets its next one at the end at the earliest.
      crossed = t[0] < t[1] ? (t[0] < t[2] ? 0 : 2) : (t[1] < t[2] ? 1 : 2);
      first = t[crossed];
      const double limit = first + crossing_margin * first;
      if ((t[0] <= limit) + (t[1] <= limit) + (t[2] <= limit) != 1) return;
      const std::uint32_t before = block[crossed];
      block[crossed] = upwards[crossed] ? before + 1 : before - 1;
      if ((before ^ block[crossed]) >> 2) break;
      if (path.taken >> child_at(block, 0) & 1) break;
      border[crossed] += (2 * upwards[crossed] - 1) * (std::int32_t{1} << level);
      t[crossed] = (border[crossed] - query.origin[crossed]) * inverse[crossed];
    }
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
  query.t = first;
  for (int axis = 0; axis < 3; ++axis) query.cell[axis] = cell[axis];
}

inline void find_first_stops(const StopTree& tree, StopQuery* queries, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) find_first_stop(tree, queries[i]);
}
