// The triangles of one leaf against those of another. The frame is b's leaf's: its origin, and its oriented box's axes
// where it has one, in which the boxes of triangles on a flat patch are thin.

/// Triangles of a leaf, corner by corner and coordinate by coordinate, and their boxes, grown where said. Lanes beyond
/// the last triangle hold anything.
struct alignas(64) LeafTriangles {
  float corner[9][16];
  float low[3][16], high[3][16];
  float extent[16];  // largest difference of two corners in one coordinate
};

/// The affine map of a's leaf into b's frame, and what float32 rounding takes there.
struct LeafFrame {
  float rotation[9], offset[3];
  float difference_error;  // of the difference of two corners in a coordinate
};

/// Both leaves keep their triangles along their boxes' axes: rows, in float64.
struct BoxAxes {
  double row[3][3];

  explicit BoxAxes(const BvhNode& node) {
    for (int i = 0; i < 6; ++i) row[i / 3][i % 3] = static_cast<double>(node.box_axis[i]);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      row[2][i] = row[0][j] * row[1][k] - row[0][k] * row[1][j];
    }
  }
};

/// b's axes * rotation * transposed a's axes. Only the result is rounded.
inline void turn_between_boxes(const double* rotation, const BoxAxes& a, const BoxAxes& b, float* out) {
  double turned[9];
  for (int i = 0; i < 3; ++i) {
    const double* r = rotation + 3 * i;
    for (int j = 0; j < 3; ++j) turned[3 * i + j] = r[0] * a.row[j][0] + r[1] * a.row[j][1] + r[2] * a.row[j][2];
  }
  for (int i = 0; i < 3; ++i) {
    const double* axis = b.row[i];
    for (int j = 0; j < 3; ++j) {
      out[3 * i + j] = static_cast<float>(axis[0] * turned[j] + axis[1] * turned[3 + j] + axis[2] * turned[6 + j]);
    }
  }
}

inline LeafFrame leaf_frame(const BvhNode& a, const BvhNode& b, const FrameChange& a_to_b, bool has_box) {
  LeafFrame frame;
  float offset[3];
  for (int i = 0; i < 3; ++i) {
    const double* r = a_to_b.rotation + 3 * i;
    // Differences of large coordinates: in float64.
    offset[i] = static_cast<float>(r[0] * static_cast<double>(a.origin[0]) + r[1] * static_cast<double>(a.origin[1]) +
                                   r[2] * static_cast<double>(a.origin[2]) + a_to_b.translation[i] -
                                   static_cast<double>(b.origin[i]));
  }
  const float x = offset[0], y = offset[1], z = offset[2];
  if (has_box) {
    const BoxAxes b_axes(b);
    turn_between_boxes(a_to_b.rotation, BoxAxes(a), b_axes, frame.rotation);
    for (int i = 0; i < 3; ++i) {
      const double* axis = b_axes.row[i];
      frame.offset[i] = static_cast<float>(axis[0] * static_cast<double>(x) + axis[1] * static_cast<double>(y) +
                                           axis[2] * static_cast<double>(z));
    }
  } else {
    for (int i = 0; i < 3; ++i) frame.offset[i] = offset[i];
    for (int i = 0; i < 9; ++i) frame.rotation[i] = a_to_b.rotation_f32[i];
  }
  // In units of reach: a's corners rounded when stored (1) along axes orthogonal up to rounding (6), turned by a
  // rounded matrix (2), moved by a rounded offset (5) and added up (4); b's corners (1); and a little.
  const float reach = a.radius + b.radius + __builtin_sqrtf(x * x + y * y + z * z);
  // Denormals are rounded by an absolute amount, 2^-150 at most each time.
  frame.difference_error = 22 * 0x1p-24f * reach + 22 * 0x1p-149f;
  return frame;
}

template <class L>
void find_boxes(LeafTriangles& out, int l, float slack, const typename L::Float (&corner)[3][3]) {
  auto extent = L::broadcast(0.0f);
  for (int c = 0; c < 3; ++c) {
    const auto low = L::min(L::min(corner[0][c], corner[1][c]), corner[2][c]);
    const auto high = L::max(L::max(corner[0][c], corner[1][c]), corner[2][c]);
    L::store(out.low[c] + l, L::subtract(low, L::broadcast(slack)));
    L::store(out.high[c] + l, L::add(high, L::broadcast(slack)));
    extent = L::max(extent, L::subtract(high, low));
  }
  L::store(out.extent + l, extent);
}

template <class L>
void load_triangles(const float* vertices, int count, int l, typename L::Float (&corner)[3][3]) {
  for (int k = 0; k < 3; ++k) {
    for (int c = 0; c < 3; ++c) corner[k][c] = L::load(vertices + (3 * k + c) * count + l);
  }
}

template <class L>
void copy_triangles(const float* vertices, int count, LeafTriangles& out) {
  for (int l = 0; l < count; l += L::width) {
    typename L::Float corner[3][3];
    load_triangles<L>(vertices, count, l, corner);
    for (int k = 0; k < 9; ++k) L::store(out.corner[k] + l, corner[k / 3][k % 3]);
    find_boxes<L>(out, l, 0, corner);
  }
}

template <class L>
void place_triangles(const float* vertices, int count, const LeafFrame& frame, LeafTriangles& out) {
  for (int l = 0; l < count; l += L::width) {
    typename L::Float from[3][3], moved[3][3];
    load_triangles<L>(vertices, count, l, from);
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) {
        const float* row = frame.rotation + 3 * c;
        auto sum = L::multiply_add(L::broadcast(row[0]), from[k][0], L::broadcast(frame.offset[c]));
        sum = L::multiply_add(L::broadcast(row[1]), from[k][1], sum);
        moved[k][c] = L::multiply_add(L::broadcast(row[2]), from[k][2], sum);
        L::store(out.corner[3 * k + c] + l, moved[k][c]);
      }
    }
    find_boxes<L>(out, l, frame.difference_error, moved);
  }
}

// Of the first `count` triangles, those whose boxes meet the box [low, high].
template <class L>
unsigned triangles_in_box(const LeafTriangles& t, int count, const float* low, const float* high) {
  unsigned in_box = 0;
  for (int l = 0; l < count; l += L::width) {
    auto in = L::both(L::not_less(L::broadcast(high[2]), L::load(t.low[2] + l)),
                      L::not_less(L::load(t.high[2] + l), L::broadcast(low[2])));
    for (int c = 0; c < 2; ++c) {
      in = L::both(in, L::both(L::not_less(L::broadcast(high[c]), L::load(t.low[c] + l)),
                               L::not_less(L::load(t.high[c] + l), L::broadcast(low[c]))));
    }
    in_box |= L::bits(in) << l;
  }
  return in_box & ((1u << count) - 1);
}

/// Triangles of two leaves whose boxes meet, by their positions in the leaves.
struct alignas(64) TrianglePairs {
  std::int32_t a[256 + 16], b[256 + 16];
  int count = 0;
};

/// `of_a`'s boxes are grown by what rounding may take.
template <class L>
void find_pairs(const LeafTriangles& of_a, unsigned in_reach, const LeafTriangles& of_b, int count_b,
                TrianglePairs& pairs) {
  for (; in_reach; in_reach &= in_reach - 1) {
    const int i = __builtin_ctz(in_reach);
    const float low[3] = {of_a.low[0][i], of_a.low[1][i], of_a.low[2][i]};
    const float high[3] = {of_a.high[0][i], of_a.high[1][i], of_a.high[2][i]};
    const unsigned found = triangles_in_box<L>(of_b, count_b, low, high);
    L::store_set_bits(found, i, pairs.a + pairs.count, pairs.b + pairs.count);
    pairs.count += __builtin_popcount(found);
  }
}

template <class L>
TrianglePairLanes<L> pair_lanes(const LeafTriangles& of_a, const LeafTriangles& of_b, const std::int32_t* a,
                                const std::int32_t* b, float difference_error) {
  TrianglePairLanes<L> pair;
  for (int c = 0; c < 3; ++c) {
    const auto origin = L::lookup(of_a.corner[c], 16, a);
    pair.a_edge[0][c] = L::subtract(L::lookup(of_a.corner[3 + c], 16, a), origin);
    pair.a_edge[1][c] = L::subtract(L::lookup(of_a.corner[6 + c], 16, a), origin);
    for (int k = 0; k < 3; ++k) pair.b[k][c] = L::subtract(L::lookup(of_b.corner[3 * k + c], 16, b), origin);
  }
  pair.a_extent = L::lookup(of_a.extent, 16, a);
  pair.b_extent = L::lookup(of_b.extent, 16, b);
  pair.difference_error = L::broadcast(difference_error);
  return pair;
}

/// Reports the contacts among the pairs; true if the traversal is to end.
template <class L>
bool settle_pairs(const TraversalQuery& q, const BvhNode& a, const BvhNode& b, const LeafTriangles& of_a,
                  const LeafTriangles& of_b, TrianglePairs& pairs, float difference_error) {
  q.counts->triangle_pairs += static_cast<unsigned>(pairs.count);
  for (int l = 0; l < L::width; ++l) pairs.a[pairs.count + l] = pairs.b[pairs.count + l] = 0;
  for (int first = 0; first < pairs.count; first += L::width) {
    const int left = pairs.count - first;
    const unsigned wanted = (1u << (left < L::width ? left : L::width)) - 1;
    const auto lanes = pair_lanes<L>(of_a, of_b, pairs.a + first, pairs.b + first, difference_error);
    const Verdicts verdicts = filter_triangles<L>(lanes, wanted);
    for (unsigned open = wanted & ~verdicts.apart; open; open &= open - 1) {
      const int lane = __builtin_ctz(open);
      const std::uint32_t at_a = a.first + static_cast<std::uint32_t>(pairs.a[first + lane]),
                          at_b = b.first + static_cast<std::uint32_t>(pairs.b[first + lane]);
      bool touching = verdicts.touching >> lane & 1;
      if (!touching) {
        ++q.counts->undecided;
        touching = q.touch(q.context, at_a, at_b);
      }
      if (touching && q.contact(q.context, at_a, at_b)) return true;
    }
  }
  return false;
}

/// Reports the contacts of one leaf pair; true if the traversal is to end.
template <class L>
bool leaf_pair(const TraversalQuery& q, const BvhNode& a, const BvhNode& b) {
  const bool has_box = q.b.has_boxes;
  const LeafFrame frame = leaf_frame(a, b, q.pose->a_to_b, has_box);
  LeafTriangles of_a, of_b;
  place_triangles<L>(q.a.leaf_vertices + 9 * std::size_t{a.first}, a.count, frame, of_a);
  unsigned in_reach = (1u << a.count) - 1;
  if (has_box) {
    float low[3], high[3];
    for (int c = 0; c < 3; ++c) low[c] = -(high[c] = b.box_half[c]);
    in_reach = triangles_in_box<L>(of_a, a.count, low, high);
    if (!in_reach) return false;
  }
  copy_triangles<L>(q.b.leaf_vertices + 9 * std::size_t{b.first}, b.count, of_b);
  TrianglePairs pairs;
  find_pairs<L>(of_a, in_reach, of_b, b.count, pairs);
  return pairs.count > 0 && settle_pairs<L>(q, a, b, of_a, of_b, pairs, frame.difference_error);
}
