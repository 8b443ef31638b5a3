// Directions of rays on the faces of a cube around their origin. Included once per instruction set, inside its
// namespace, after its Lanes.

static constexpr float least_beam_depth = 0x1p-30f;

// The loop that compilers vectorise; `face` is 2 * axis, + 1 for the negative sense.
static bool project_directions(const BeamProjection& rays) {
  const double ox = rays.origin[0], oy = rays.origin[1], oz = rays.origin[2];
  const double *ex = rays.end[0], *ey = rays.end[1], *ez = rays.end[2];
  std::uint32_t* faces = rays.face;
  float *us = rays.u, *vs = rays.v, *depths = rays.depth;
  float least = __builtin_inff();
  for (std::size_t i = 0; i < rays.count; ++i) {
    const float x = static_cast<float>(ex[i] - ox), y = static_cast<float>(ey[i] - oy);
    const float z = static_cast<float>(ez[i] - oz);
    const float ax = __builtin_fabsf(x), ay = __builtin_fabsf(y), az = __builtin_fabsf(z);
    const float axy = ax > ay ? ax : ay, depth = axy > az ? axy : az;
    const bool along_x = ax >= axy && ax >= az, along_y = !along_x && ay >= az;
    const float w = along_x ? x : along_y ? y : z;
    const float per_depth = 1 / depth;
    us[i] = (along_x ? y : x) * per_depth;
    vs[i] = (along_x || along_y ? z : y) * per_depth;
    depths[i] = depth;
    faces[i] = (along_x ? 0u : along_y ? 2u : 4u) + (w < 0 ? 1u : 0u);
    least = least < depth ? least : depth;
  }
  return least >= least_beam_depth;
}

// Least and greatest u and v per face.
template <class L>
static void bound_directions(const BeamProjection& rays, BeamBounds (&bounds)[6]) {
  using F = typename L::Float;
  using M = typename L::Mask;
  const F infinity = L::broadcast(__builtin_inff()), minus_infinity = L::broadcast(-__builtin_inff());
  F low_u[6], low_v[6], high_u[6], high_v[6];
  for (int f = 0; f < 6; ++f) {
    low_u[f] = low_v[f] = infinity;
    high_u[f] = high_v[f] = minus_infinity;
  }
  for (std::size_t first = 0; first < rays.count; first += L::width) {
    const typename L::Uint faces = L::load(rays.face + first);
    const F u = L::load(rays.u + first), v = L::load(rays.v + first);
    const std::size_t left = rays.count - first;
    unsigned open = L::bits(L::first_lanes(left < L::width ? static_cast<std::uint32_t>(left) : L::width));
    while (open) {
      const std::uint32_t face = rays.face[first + static_cast<unsigned>(__builtin_ctz(open))];
      const M same = L::both(L::equal(faces, L::broadcast(face)), L::from_bits(open));
      open &= ~L::bits(same);
      low_u[face] = L::min(low_u[face], L::select(same, u, infinity));
      low_v[face] = L::min(low_v[face], L::select(same, v, infinity));
      high_u[face] = L::max(high_u[face], L::select(same, u, minus_infinity));
      high_v[face] = L::max(high_v[face], L::select(same, v, minus_infinity));
      bounds[face].count += static_cast<std::uint32_t>(__builtin_popcount(L::bits(same)));
    }
  }
  for (int f = 0; f < 6; ++f) {
    bounds[f].u[0] = L::reduce_min(low_u[f]);
    bounds[f].v[0] = L::reduce_min(low_v[f]);
    bounds[f].u[1] = L::reduce_max(high_u[f]);
    bounds[f].v[1] = L::reduce_max(high_v[f]);
  }
}
