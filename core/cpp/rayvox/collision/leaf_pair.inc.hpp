// The triangles of one leaf against those of another.

/// The triangles of a leaf (corner by corner, coordinate by coordinate) in the frame where two leaves are compared.
struct alignas(64) LeafTriangles {
  float corner[9][16];
  float low[3][16], high[3][16];
  float extent[16];  // largest difference of two corners in one coordinate
};

/// The affine map of a's leaf into the frame where the leaves are compared, and what float32 rounding takes there.
struct LeafFrame {
  float rotation[9], offset[3];
  float difference_error;  // of the difference of two corners in a coordinate
};

// The frame is b's leaf's: its origin, and its oriented box's axes where it has one, in which the boxes of triangles on
// a flat patch are thin.
inline LeafFrame leaf_frame(const BvhNode& a, const BvhNode& b, const FrameChange& a_to_b, bool has_box) {
  LeafFrame frame;
  double offset[3];
  for (int i = 0; i < 3; ++i) {
    const double* r = a_to_b.rotation + 3 * i;
    // Differences of large coordinates: in float64.
    offset[i] = r[0] * static_cast<double>(a.origin[0]) + r[1] * static_cast<double>(a.origin[1]) +
                r[2] * static_cast<double>(a.origin[2]) + a_to_b.translation[i] - static_cast<double>(b.origin[i]);
  }
  const float x = static_cast<float>(offset[0]), y = static_cast<float>(offset[1]), z = static_cast<float>(offset[2]);
  const float* r = a_to_b.rotation_f32;
  for (int i = 0; i < 3; ++i) {
    const float* axis = b.box_axis + 3 * i;
    for (int j = 0; j < 3; ++j) {
      frame.rotation[3 * i + j] = has_box ? axis[0] * r[j] + axis[1] * r[3 + j] + axis[2] * r[6 + j] : r[3 * i + j];
    }
    frame.offset[i] = has_box ? axis[0] * x + axis[1] * y + axis[2] * z : static_cast<float>(offset[i]);
  }
  // a's corners: rounded when stored (1 unit of reach), turned by a rounded matrix (8), added up (8); b's: 5.
  const float reach = a.radius + b.radius + __builtin_sqrtf(x * x + y * y + z * z);
  // Denormals are rounded by an absolute amount, 2^-150 at most each time.
  frame.difference_error = 22 * 0x1p-24f * reach + 22 * 0x1p-149f;
  return frame;
}

template <class L>
void place_triangles(const float* vertices, int count, const float* rotation, const float* offset, LeafTriangles& out) {
  for (int l = 0; l < count; l += L::width) {
    const int n = count - l;
    for (int corner = 0; corner < 3; ++corner) {
      const float* from = vertices + 3 * corner * count + l;
      const auto x = L::load_first(from, n), y = L::load_first(from + count, n), z = L::load_first(from + 2 * count, n);
      for (int c = 0; c < 3; ++c) {
        auto moved = L::multiply_add(L::broadcast(rotation[3 * c]), x, L::broadcast(offset[c]));
        moved = L::multiply_add(L::broadcast(rotation[3 * c + 1]), y, moved);
        moved = L::multiply_add(L::broadcast(rotation[3 * c + 2]), z, moved);
        L::store(out.corner[3 * corner + c] + l, moved);
      }
    }
    auto extent = L::broadcast(0.0f);
    for (int c = 0; c < 3; ++c) {
      const auto p = L::load(out.corner[c] + l), q = L::load(out.corner[3 + c] + l), r = L::load(out.corner[6 + c] + l);
      const auto low = L::min(L::min(p, q), r), high = L::max(L::max(p, q), r);
      L::store(out.low[c] + l, low);
      L::store(out.high[c] + l, high);
      extent = L::max(extent, L::subtract(high, low));
    }
    L::store(out.extent + l, extent);
  }
}

// Lanes of `t` from l on whose boxes meet the box [low, high].
template <class L>
unsigned lanes_in_box(const LeafTriangles& t, int l, const float* low, const float* high) {
  auto in = L::both(L::not_less(L::broadcast(high[2]), L::load(t.low[2] + l)),
                    L::not_less(L::load(t.high[2] + l), L::broadcast(low[2])));
  for (int c = 0; c < 2; ++c) {
    in = L::both(in, L::both(L::not_less(L::broadcast(high[c]), L::load(t.low[c] + l)),
                             L::not_less(L::load(t.high[c] + l), L::broadcast(low[c]))));
  }
  return L::bits(in);
}

template <class L>
TriangleLanes<L> lanes_relative_to(const LeafTriangles& t, int l, const float* origin) {
  TriangleLanes<L> lanes;
  for (int corner = 0; corner < 3; ++corner) {
    for (int c = 0; c < 3; ++c) {
      lanes.corner[corner][c] = L::subtract(L::load(t.corner[3 * corner + c] + l), L::broadcast(origin[c]));
    }
  }
  return lanes;
}

inline OneTriangle triangle_at(const LeafTriangles& t, int i, float* origin) {
  OneTriangle one;
  for (int c = 0; c < 3; ++c) {
    origin[c] = t.corner[c][i];
    one.e1[c] = t.corner[3 + c][i] - origin[c];
    one.e2[c] = t.corner[6 + c][i] - origin[c];
  }
  for (int c = 0; c < 3; ++c) {
    const int j = (c + 1) % 3, k = (c + 2) % 3;
    one.normal[c] = one.e1[j] * one.e2[k] - one.e1[k] * one.e2[j];
  }
  return one;
}

/// Reports the contacts of one leaf pair; true if the traversal is to end.
template <class L>
bool leaf_pair(const TraversalQuery& q, const BvhNode& a, const BvhNode& b) {
  const bool has_box = q.b.boxes != nullptr;
  const LeafFrame frame = leaf_frame(a, b, q.pose->a_to_b, has_box);
  LeafTriangles of_a, of_b;
  const float none[3] = {}, unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  place_triangles<L>(q.a.leaf_vertices + 9 * std::size_t{a.first}, a.count, frame.rotation, frame.offset, of_a);
  const float slack = frame.difference_error;

  unsigned in_reach = (1u << a.count) - 1;
  if (has_box) {
    float low[3], high[3];
    for (int c = 0; c < 3; ++c) low[c] = -(high[c] = b.box_half[c] + slack);
    unsigned in = 0;
    for (int l = 0; l < a.count; l += L::width) in |= lanes_in_box<L>(of_a, l, low, high) << l;
    in_reach &= in;
    if (!in_reach) return false;
  }
  place_triangles<L>(q.b.leaf_vertices + 9 * std::size_t{b.first}, b.count, has_box ? b.box_axis : unit, none, of_b);
  for (; in_reach; in_reach &= in_reach - 1) {
    const int i = __builtin_ctz(in_reach);
    float low[3], high[3], origin[3];
    for (int c = 0; c < 3; ++c) low[c] = of_a.low[c][i] - slack, high[c] = of_a.high[c][i] + slack;
    for (int l = 0; l < b.count; l += L::width) {
      const int left = b.count - l;
      const unsigned in =
          lanes_in_box<L>(of_b, l, low, high) & (left >= L::width ? (1u << L::width) - 1 : (1u << left) - 1);
      if (!in) continue;
      q.counts->triangle_pairs += static_cast<unsigned>(__builtin_popcount(in));
      const OneTriangle one = triangle_at(of_a, i, origin);
      const TriangleLanes<L> lanes = lanes_relative_to<L>(of_b, l, origin);
      typename L::Float e1[3], e2[3], normal[3];
      for (int c = 0; c < 3; ++c) {
        e1[c] = L::subtract(lanes.corner[1][c], lanes.corner[0][c]);
        e2[c] = L::subtract(lanes.corner[2][c], lanes.corner[0][c]);
      }
      cross<L>(e1, e2, normal);
      const FilterBounds<L> bounds(of_a.extent[i], L::load(of_b.extent + l), frame.difference_error);
      const Verdicts verdicts = filter_triangles<L>(one, lanes, normal, bounds, in);
      for (unsigned left_over = in & ~verdicts.apart; left_over; left_over &= left_over - 1) {
        const int j = __builtin_ctz(left_over);
        const std::uint32_t at_a = a.first + static_cast<std::uint32_t>(i),
                            at_b = b.first + static_cast<std::uint32_t>(l + j);
        bool touching = verdicts.touching >> j & 1;
        if (!touching) {
          ++q.counts->undecided;
          touching = q.touch(q.context, at_a, at_b);
        }
        if (touching && q.contact(q.context, at_a, at_b)) return true;
      }
    }
  }
  return false;
}
