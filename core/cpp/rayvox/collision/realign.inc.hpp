// Re-enclosing a k-DOP in another frame's axes (Zachmann, "Rapid Collision Detection by Dynamically Aligned
// DOP-Trees", VRAIS 1998), always from the original one, so that looseness never accumulates.

template <class L>
void choose_cones(const ConeRows& cones, const float (*direction)[16], std::int32_t* cone) {
  for (int l = 0; l < 16; l += L::width) {
    const auto x = L::load(direction[0] + l), y = L::load(direction[1] + l), z = L::load(direction[2] + l);
    auto best = L::broadcast(0.0f), chosen = best;
    for (int c = 0; c < cones.cone_count; ++c) {
      // A ray leaves a convex hull through the face whose plane it meets first.
      auto reached = L::multiply(L::broadcast(cones.plane[0][c]), x);
      reached = L::multiply_add(L::broadcast(cones.plane[1][c]), y, reached);
      reached = L::multiply_add(L::broadcast(cones.plane[2][c]), z, reached);
      const auto nearer = L::greater(reached, best);
      best = L::select(nearer, reached, best);
      chosen = L::select(nearer, L::broadcast(static_cast<float>(c)), chosen);
    }
    alignas(64) float index[16];
    L::store(index, chosen);
    for (int i = 0; i < L::width; ++i) cone[l + i] = static_cast<std::int32_t>(index[i]);
  }
}

struct Offset {
  float x, y, z;
};

/// Where `from`'s origin lies relative to `to`'s, in `to`'s frame.
inline Offset offset_between(const BvhNode& from, const BvhNode& to, const FrameChange& change) {
  const float* r = change.rotation_f32;
  const float* t = change.translation_f32;
  const float x = from.origin[0], y = from.origin[1], z = from.origin[2];
  return {r[0] * x + r[1] * y + r[2] * z + t[0] - to.origin[0], r[3] * x + r[4] * y + r[5] * z + t[1] - to.origin[1],
          r[6] * x + r[7] * y + r[8] * z + t[2] - to.origin[2]};
}

/// What each slab must reach, of a volume kept relative to `to`, if it overlaps the k-DOP of `from`.
template <class L, class Slab>
void realign(const Slab* own, const BvhNode& from, const BvhNode& to, const FrameChange& change,
             const OrientationRows& rows, float margin_m, int stride, float* threshold) {
  alignas(64) float table[32];
  for (int i = 0; i < stride; i += L::width) L::store(table + i, L::load(own + i));
  const Offset d = offset_between(from, to, change);
  const auto minus_unit = L::broadcast(-from.slab_unit), per_unit = L::broadcast(1.0f / to.slab_unit);
  for (int i = 0; i < stride; i += L::width) {
    auto sum = L::multiply(L::load(change.coefficient[0] + i), L::lookup(table, stride, change.index[0] + i));
    sum = L::multiply_add(L::load(change.coefficient[1] + i), L::lookup(table, stride, change.index[1] + i), sum);
    sum = L::multiply_add(L::load(change.coefficient[2] + i), L::lookup(table, stride, change.index[2] + i), sum);
    auto moved = L::multiply_add(L::load(rows.coordinate[0] + i), L::broadcast(d.x), L::broadcast(-margin_m));
    moved = L::multiply_add(L::load(rows.coordinate[1] + i), L::broadcast(d.y), moved);
    moved = L::multiply_add(L::load(rows.coordinate[2] + i), L::broadcast(d.z), moved);
    L::store(threshold + i, L::multiply(L::multiply_add(sum, minus_unit, moved), per_unit));
  }
}
