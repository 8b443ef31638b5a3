// Points of a scan turned into the ends of its rays: transformed, cut at the scan's range, in voxel units. Plain loops
// over small blocks, which compilers vectorise; every operation rounds as in the scalar order, so that all instruction
// sets give the same bits. Included once per instruction set, inside its namespace, after beam_project.inc.hpp.

static constexpr int points_per_block = 64;

struct PointBlock {
  alignas(64) double x[points_per_block], y[points_per_block], z[points_per_block];
};

template <class T>
static void load_points(const T* from, int count, const double offset[3], PointBlock& to) {
  for (int i = 0; i < count; ++i) {
    to.x[i] = offset[0] + from[3 * i];
    to.y[i] = offset[1] + from[3 * i + 1];
    to.z[i] = offset[2] + from[3 * i + 2];
  }
}

static void transform_points(const double r[9], const double t[3], PointBlock& p) {
  for (int i = 0; i < points_per_block; ++i) {
    const double x = p.x[i], y = p.y[i], z = p.z[i];
    p.x[i] = r[0] * x + r[1] * y + r[2] * z + t[0];
    p.y[i] = r[3] * x + r[4] * y + r[5] * z + t[1];
    p.z[i] = r[6] * x + r[7] * y + r[8] * z + t[2];
  }
}

// True only if no point lies beyond the range: most blocks need no root and no quotient.
static bool all_in_range(const double origin[3], double max_range, const PointBlock& p) {
  const double limit = max_range * max_range * (1 - 0x1p-40);
  std::uint64_t doubtful = 0;
  for (int i = 0; i < points_per_block; ++i) {
    const double x = p.x[i] - origin[0], y = p.y[i] - origin[1], z = p.z[i] - origin[2];
    doubtful += x * x + y * y + z * z >= limit;
  }
  return doubtful == 0;
}

// False, with `beyond` unset, if no point is cut.
static bool cut_at_range(const double origin[3], double max_range, PointBlock& p, std::uint64_t* beyond) {
  if (all_in_range(origin, max_range, p)) return false;
  for (int i = 0; i < points_per_block; ++i) {
    const double x = p.x[i] - origin[0], y = p.y[i] - origin[1], z = p.z[i] - origin[2];
    const double length = __builtin_sqrt(x * x + y * y + z * z), scale = max_range / length;
    const bool cut = length > max_range;
    p.x[i] = cut ? origin[0] + x * scale : p.x[i];
    p.y[i] = cut ? origin[1] + y * scale : p.y[i];
    p.z[i] = cut ? origin[2] + z * scale : p.z[i];
    beyond[i] = cut;
  }
  return true;
}

// One coordinate of all points in voxel units (MapGeometry::to_voxel_units); how many lie outside the octree.
static std::uint64_t to_voxel_units(const double* metres, double resolution_m, double half_extent, double* out) {
  constexpr double tiny = 0x1p-200;
  std::uint64_t outside = 0;
  for (int i = 0; i < points_per_block; ++i) {
    double u = metres[i] / resolution_m;
    u = u > 0 && u < tiny ? tiny : u < 0 && u > -tiny ? -tiny : u;
    outside += !(u >= -half_extent && u < half_extent);
    out[i] = u;
  }
  return outside;
}

static bool make_ray_ends(const RayEnds& rays) {
  std::uint64_t outside = 0;
  for (std::size_t first = 0; first < rays.count; first += points_per_block) {
    const std::size_t left = rays.count - first;
    const int count = left < points_per_block ? static_cast<int>(left) : points_per_block;
    PointBlock block, ends;
    alignas(64) std::uint64_t beyond[points_per_block];
    alignas(64) std::uint8_t marks_end[points_per_block];
    if (rays.f32) {
      load_points(rays.f32 + 3 * first, count, rays.offset, block);
    } else {
      load_points(rays.f64 + 3 * first, count, rays.offset, block);
    }
    for (int i = count; i < points_per_block; ++i) {
      block.x[i] = block.x[0];
      block.y[i] = block.y[0];
      block.z[i] = block.z[0];
    }
    transform_points(rays.rotation, rays.translation, block);
    const bool cut = rays.max_range_m > 0 && cut_at_range(rays.origin_m, rays.max_range_m, block, beyond);
    outside += to_voxel_units(block.x, rays.resolution_m, rays.half_extent, ends.x);
    outside += to_voxel_units(block.y, rays.resolution_m, rays.half_extent, ends.y);
    outside += to_voxel_units(block.z, rays.resolution_m, rays.half_extent, ends.z);
    for (int i = 0; i < points_per_block; ++i) marks_end[i] = rays.returned;
    for (int i = 0; cut && i < points_per_block; ++i) marks_end[i] &= static_cast<std::uint8_t>(beyond[i] == 0);
    const auto made = static_cast<std::size_t>(count);
    copy_block<points_per_block>(ends.x, made, rays.end[0] + first);
    copy_block<points_per_block>(ends.y, made, rays.end[1] + first);
    copy_block<points_per_block>(ends.z, made, rays.end[2] + first);
    copy_block<points_per_block>(marks_end, made, rays.marks_end + first);
  }
  return outside == 0;
}
