#pragma once
// A scan's rays as the beam engine sees them: sorted into bins of direction, so that the rays that can meet a box are
// found from the box. Plain data, shared with the kernels of every instruction set.
#include <cstddef>
#include <cstdint>

namespace rayvox {

constexpr int max_beam_levels = 11;

/// The rays whose direction has its largest component along one axis, in one sense. Directions are (u, v) =
/// (d[u_axis], d[v_axis]) / depth in [-1, 1], with depth = sign * d[axis]; `rows` x `columns` square bins cover those
/// that occur.
struct BeamFace {
  std::int32_t axis, u_axis, v_axis;
  float sign;
  float u_low, v_low, bins_per_unit;
  std::int32_t columns, rows, levels;
  /// Greatest depth of a ray's end per bin (0: no ray), and per 2^level x 2^level bins; row-major, a level's bins from
  /// `level_start`; 16 more may be read, not used.
  const float* farthest;
  std::uint32_t level_start[16], level_columns[16];
  /// The deepest ray of each bin, row-major; in an empty bin one that passes nothing.
  const std::uint32_t* deepest;
  /// Where each bin's rays start, row-major; one more entry ends the last bin.
  const std::uint32_t* bin_start;
};

/// A ray sorted into its bin: 1 / u, 1 / v, the depth of its end (all float32) and its index in the scan.
struct alignas(16) BeamRay {
  float inverse_u, inverse_v, depth;
  std::uint32_t ray;
};

/// All faces that have rays. Lengths in voxel units.
struct BeamScan {
  double origin[3], origin_cell[3];
  const double* end[3];  // by index in the scan
  BeamFace face[6];
  std::int32_t face_count;
  const BeamRay* rays;  // by bin; 16 more may be read, not used
};

/// An aligned block of 2^level cells along each axis, by its lowest cell.
struct CellBlock {
  std::int32_t cell[3];
  std::int32_t level;

  std::int32_t size() const { return std::int32_t{1} << level; }
};

/// Rays of which to find the directions. `face` is 2 * axis, + 1 for the negative sense. All arrays have room for 16
/// elements beyond `count`.
struct BeamProjection {
  double origin[3];
  const double* end[3];
  std::uint32_t* face;
  float *u, *v, *depth;
  std::size_t count;
};

/// Directions of one face: least and greatest, and how many.
struct BeamBounds {
  float u[2], v[2];
  std::uint32_t count;
};

/// Where the bins of each face lie: of face f (as in BeamProjection), from bin `first[f]` on, row-major. Six faces; the
/// rest fills vectors.
struct BeamBins {
  float u_low[8], v_low[8], bins_per_unit[8], last_column[8], last_row[8];
  std::uint32_t first[16], columns[16];
};

/// Directions this close to a coordinate plane are stored as if in it (inverse +-2^100); cells whose border plane holds
/// the origin decide such rays exactly.
constexpr float beam_flat = 0x1p-100f;

/// Smallest bin, so that float32 positions among bins err by less than beam_bin_margin.
constexpr float min_beam_bin = 0x1p-12f;
constexpr float beam_bin_margin = 0x1p-6f;
/// Relative error bound on float32 depths and crossings.
constexpr float beam_margin = 0x1p-19f;

}  // namespace rayvox
