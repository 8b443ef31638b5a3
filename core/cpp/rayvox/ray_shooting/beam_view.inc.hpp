// Boxes as the beam engine sees them: from the origin, through a face of the cube of directions, against the bins.
// Included once per instruction set, inside its namespace.

// A box seen from the origin through one face of the cube of directions, in units of depth.
struct SeenBox {
  float near, far, u[2], v[2];
};

static inline SeenBox see_block(const BeamScan& scan, const BeamFace& face, const CellBlock& block) {
  const std::int32_t size = 1 << block.level;
  const auto low = [&](std::int32_t axis) { return static_cast<float>(block.cell[axis] - scan.origin[axis]); };
  const auto high = [&](std::int32_t axis) { return static_cast<float>(block.cell[axis] + size - scan.origin[axis]); };
  const bool up = face.sign > 0;
  return {up ? low(face.axis) : -high(face.axis),
          up ? high(face.axis) : -low(face.axis),
          {low(face.u_axis), high(face.u_axis)},
          {low(face.v_axis), high(face.v_axis)}};
}

struct BinRange {
  std::int32_t first, last;
};

// The bins that directions low/depth .. high/depth can lie in, for depths from `near` (at or below 0: any) to `far`.
static inline BinRange bins_covering(float low, float high, float near, float far, float face_low, float bins_per_unit,
                                     std::int32_t count) {
  const float scale_near = near > 0 ? 1 / near : __builtin_inff(), scale_far = 1 / far;
  const float first = ((low < 0 ? low * scale_near : low * scale_far) - face_low) * bins_per_unit - beam_bin_margin;
  const float last = ((high > 0 ? high * scale_near : high * scale_far) - face_low) * bins_per_unit + beam_bin_margin;
  const float limit = static_cast<float>(count);
  if (!(first < limit && last >= 0)) return {0, -1};
  return {first > 0 ? static_cast<std::int32_t>(first) : 0, last < limit ? static_cast<std::int32_t>(last) : count - 1};
}

struct BinRect {
  BinRange u, v;  // both empty or neither
};

// The bins of directions that can enter the box.
static inline BinRect bins_of(const BeamFace& face, const SeenBox& box) {
  constexpr BinRect none{{0, -1}, {0, -1}};
  if (!(box.far > 0)) return none;
  const float scale = face.bins_per_unit;
  const BinRect bins{bins_covering(box.u[0], box.u[1], box.near, box.far, face.u_low, scale, face.columns),
                     bins_covering(box.v[0], box.v[1], box.near, box.far, face.v_low, scale, face.rows)};
  return bins.u.last < bins.u.first || bins.v.last < bins.v.first ? none : bins;
}

// False only if no ray of the face enters the box.
static inline bool face_reaches(const BeamFace& face, const SeenBox& box) {
  const auto [u, v] = bins_of(face, box);
  if (v.last < v.first) return false;
  const std::int32_t span_u = u.last - u.first, span_v = v.last - v.first, span = span_u > span_v ? span_u : span_v;
  // At this level the range covers at most 5 x 5 bins.
  int level = span < 4 ? 0 : 30 - __builtin_clz(static_cast<unsigned>(span));
  if (level > face.levels - 1) level = face.levels - 1;
  const float* bins = face.farthest + face.level_start[level];
  const float near = box.near * (1 - beam_margin);
  for (std::int32_t row = v.first >> level; row <= v.last >> level; ++row) {
    const float* in_row = bins + static_cast<std::size_t>(row) * face.level_columns[level];
    for (std::int32_t column = u.first >> level; column <= u.last >> level; ++column) {
      if (in_row[column] > (near > 0 ? near : 0)) return true;
    }
  }
  return false;
}

// Whether the block holds the origin's cell.
static inline bool holds_origin(const BeamScan& scan, const CellBlock& block) {
  bool inside = true;
  for (int axis = 0; axis < 3; ++axis) {
    const double into = scan.origin_cell[axis] - block.cell[axis];
    inside = inside && into >= 0 && into < (1 << block.level);
  }
  return inside;
}

static bool beam_reaches(const BeamScan& scan, const CellBlock& block) {
  if (holds_origin(scan, block)) return true;  // it may lie on the border, where no ray is seen to enter
  for (int f = 0; f < scan.face_count; ++f) {
    if (face_reaches(scan.face[f], see_block(scan, scan.face[f], block))) return true;
  }
  return false;
}
