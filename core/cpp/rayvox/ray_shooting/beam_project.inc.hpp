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

static inline float inverse_of_direction(float u) {
  return __builtin_fabsf(u) < beam_flat ? __builtin_copysignf(1 / beam_flat, u) : 1 / u;
}

static inline std::int32_t bin_along(float direction, float low, float bins_per_unit, std::int32_t last) {
  const auto bin = static_cast<std::int32_t>((direction - low) * bins_per_unit);
  return bin < last ? bin : last;
}

// Again for the compiler to vectorise.
static double find_bins(const BeamProjection& rays, const BeamBins& all) {
  const BeamBins bins = all;  // a copy, which the compiler knows nobody else writes
  std::uint32_t* faces = rays.face;
  float *us = rays.u, *vs = rays.v;
  for (std::size_t i = 0; i < rays.count; ++i) {
    const auto f = static_cast<std::int32_t>(faces[i]);
    const std::int32_t column = bin_along(us[i], bins.u_low[f], bins.bins_per_unit[f], bins.last_column[f]);
    const std::int32_t row = bin_along(vs[i], bins.v_low[f], bins.bins_per_unit[f], bins.last_row[f]);
    faces[i] = static_cast<std::uint32_t>(bins.first[f] + row * bins.columns[f] + column);
    us[i] = inverse_of_direction(us[i]);
    vs[i] = inverse_of_direction(vs[i]);
  }
  double total[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= rays.count; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) total[k] += rays.depth[i + k];
  }
  for (; i < rays.count; ++i) total[0] += rays.depth[i];
  return total[0] + total[1] + total[2] + total[3] + total[4] + total[5] + total[6] + total[7];
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
