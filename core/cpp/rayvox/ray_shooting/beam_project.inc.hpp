// Directions of rays on the faces of a cube around their origin. Included once per instruction set, inside its
// namespace, after its Lanes.

static constexpr float least_beam_depth = 0x1p-30f;

static constexpr int directions_per_block = 64;

// Copies up to `most` values; that many, the usual case, without a loop.
template <int most, class T>
static inline void copy_block(const T* from, std::size_t count, T* to) {
  if (count == most) {
    __builtin_memcpy(to, from, most * sizeof(T));
  } else {
    for (std::size_t i = 0; i < count; ++i) to[i] = from[i];
  }
}

// Ray ends relative to the origin, one coordinate; idle lanes get 1.
static void subtract_origin(const double* end, double origin, std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<float>(end[i] - origin);
  for (std::size_t i = count; i < directions_per_block; ++i) out[i] = 1;
}

// `face` is 2 * axis, + 1 for the negative sense.
template <class L>
static bool project_directions(const BeamProjection& rays) {
  using F = typename L::Float;
  using U = typename L::Uint;
  using M = typename L::Mask;
  const F zero = L::broadcast(0.0f), one = L::broadcast(1.0f);
  F least = L::broadcast(__builtin_inff());
  for (std::size_t first = 0; first < rays.count; first += directions_per_block) {
    const std::size_t left = rays.count - first, count = left < directions_per_block ? left : directions_per_block;
    alignas(64) float coordinate[3][directions_per_block], us[directions_per_block], vs[directions_per_block],
        depths[directions_per_block];
    alignas(64) std::uint32_t faces[directions_per_block];
    for (int axis = 0; axis < 3; ++axis) {
      subtract_origin(rays.end[axis] + first, rays.origin[axis], count, coordinate[axis]);
    }
    for (int i = 0; i < directions_per_block; i += L::width) {
      const F x = L::load(coordinate[0] + i), y = L::load(coordinate[1] + i), z = L::load(coordinate[2] + i);
      const F ax = L::absolute(x), ay = L::absolute(y), az = L::absolute(z);
      const M along_x = L::both(L::less_equal(ay, ax), L::less_equal(az, ax));
      const M along_y = L::both(L::invert(along_x), L::less_equal(az, ay));
      const F depth = L::max(L::max(ax, ay), az), per_depth = L::divide(one, depth);
      const M negative = L::less_than(L::select(along_x, x, L::select(along_y, y, z)), zero);
      const U axis = L::select(along_x, L::broadcast(0u), L::select(along_y, L::broadcast(2u), L::broadcast(4u)));
      L::store(us + i, L::multiply(L::select(along_x, y, x), per_depth));
      L::store(vs + i, L::multiply(L::select(L::either(along_x, along_y), z, y), per_depth));
      L::store(depths + i, depth);
      L::store(faces + i, L::add(axis, L::select(negative, L::broadcast(1u), L::broadcast(0u))));
      least = L::min(least, depth);
    }
    copy_block<directions_per_block>(us, count, rays.u + first);
    copy_block<directions_per_block>(vs, count, rays.v + first);
    copy_block<directions_per_block>(depths, count, rays.depth + first);
    copy_block<directions_per_block>(faces, count, rays.face + first);
  }
  return L::reduce_min(least) >= least_beam_depth;
}

template <class L>
static typename L::Float inverse_of_direction(typename L::Float u) {
  const auto flat =
      L::select(L::less_than(u, L::broadcast(0.0f)), L::broadcast(-1 / beam_flat), L::broadcast(1 / beam_flat));
  return L::select(L::less_than(L::absolute(u), L::broadcast(beam_flat)), flat, L::divide(L::broadcast(1.0f), u));
}

// One vector of rays: faces to bins, directions to their inverses.
template <class L>
static inline void find_bins_of_lanes(const BeamBins& bins, std::uint32_t* faces, float* us, float* vs) {
  using F = typename L::Float;
  using U = typename L::Uint;
  const U face = L::load(faces);
  const F u = L::load(us), v = L::load(vs), scale = L::lookup8(bins.bins_per_unit, face);
  const F column =
      L::min(L::multiply(L::subtract(u, L::lookup8(bins.u_low, face)), scale), L::lookup8(bins.last_column, face));
  const F row =
      L::min(L::multiply(L::subtract(v, L::lookup8(bins.v_low, face)), scale), L::lookup8(bins.last_row, face));
  const U row_start = L::multiply(L::to_uint(row), L::lookup(bins.columns, face));
  L::store(faces, L::add(L::lookup(bins.first, face), L::add(row_start, L::to_uint(column))));
  L::store(us, inverse_of_direction<L>(u));
  L::store(vs, inverse_of_direction<L>(v));
}

template <class L>
static double find_bins(const BeamProjection& rays, const BeamBins& bins) {
  std::size_t first = 0;
  for (; first + L::width <= rays.count; first += L::width) {
    find_bins_of_lanes<L>(bins, rays.face + first, rays.u + first, rays.v + first);
  }
  if (first < rays.count) {  // what follows may be another thread's
    alignas(64) std::uint32_t faces[L::width] = {};
    alignas(64) float us[L::width] = {}, vs[L::width] = {};
    const std::size_t left = rays.count - first;
    copy_block<L::width>(rays.face + first, left, faces);
    copy_block<L::width>(rays.u + first, left, us);
    copy_block<L::width>(rays.v + first, left, vs);
    find_bins_of_lanes<L>(bins, faces, us, vs);
    copy_block<L::width>(faces, left, rays.face + first);
    copy_block<L::width>(us, left, rays.u + first);
    copy_block<L::width>(vs, left, rays.v + first);
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
