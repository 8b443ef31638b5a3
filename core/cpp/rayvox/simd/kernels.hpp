#pragma once
// The kernels that exist once per instruction set, chosen at run time. The same sources (ray_shooting/dda_walk.inc.hpp,
// octree/octant_update.inc.hpp) are compiled for each set in a namespace of its own, with that set's flags. Those
// translation units may call nothing inline that the rest of the program shares, or the linker could pick their copy of
// it for machines without the instructions.
#include <cstddef>
#include <cstdint>

#include "rayvox/ray_shooting/beam_scan.hpp"
#include "rayvox/ray_shooting/segment.hpp"
#include "rayvox/ray_shooting/stop_tree.hpp"

namespace rayvox {

constexpr int tile_address_bits = 18;
constexpr std::size_t tile_cells = std::size_t{1} << tile_address_bits;
constexpr std::size_t bricks_per_tile = tile_cells / 512;

/// Byte marks of one tile's cells, in Morton order. All zero between uses.
struct alignas(64) TileMarks {
  enum : std::uint8_t { none = 0, free = 1, occupied = 2 };
  std::uint8_t cell[tile_cells + 64];  // the last 64 take the stores of idle lanes
};

/// The rays (structure of arrays, voxel units) and the segments of them that lie in one tile.
struct TileSegments {
  double origin[3];
  const double* end[3];
  std::int32_t tile_cell[3];  // lowest cell of the tile
  const Segment* segments;
  std::size_t count;
};

/// Rays with a common origin, for float32 arithmetic. Lanes without a ray repeat another one.
struct alignas(64) RayPacket {
  static constexpr int width = 16;
  float direction[3][width], inverse[3][width];  // of the whole ray, voxel units; any finite inverse for 0
  float end_cell[3][width];                      // counted from the cell of the origin
  std::uint32_t exact_only = 0;                  // rays (a bit each) that float32 cannot tell from axis-parallel ones
};
/// A box of cells inside an octree node, as such a packet sees it.
struct PacketBox {
  float first[3];         // lowest cell, counted from the cell of the origin
  float low[3], high[3];  // borders, voxel units from the origin
  float size;
};
/// For each of `lanes` (a bit per ray): the cell, counted from the box's lowest, in which the ray enters the box, and
/// how many borders it crosses from there, the one by which it leaves the box included. Rays for which rounding could
/// change that are in `doubtful` instead.
struct alignas(64) PassedBox {
  float entry[3][RayPacket::width], crossings[RayPacket::width];
  std::uint32_t lanes, doubtful;
};

/// One scan's update of one octant (64 cells).
struct OctantInput {
  const float* log_odds;  // 64 values, 0 where unknown
  std::uint64_t known, free, occupied;
};
struct OctantOutput {
  std::uint64_t changed;  // cells whose log-odds changed or that became known
  float min, max;         // over the cells known afterwards
};
struct UpdateModel {
  float hit, miss, clamp_min, clamp_max;  // log-odds
};

/// Points (n x 3, one of the two pointers null) and the ray ends they are turned into.
struct RayEnds {
  const float* f32;
  const double* f64;
  std::size_t count;
  double offset[3];  // added before the transform
  double rotation[9], translation[3], origin_m[3];
  double max_range_m, resolution_m, half_extent;
  bool returned;
  double* end[3];
  std::uint8_t* marks_end;
};

/// Ray ends (voxel units) of which to find the cells: their tile, 21 bits a coordinate counted in tiles from the
/// octree's lowest corner, and their Morton code within it.
struct EndCells {
  const double* end[3];
  const std::uint8_t* marks_end;
  std::size_t count;
  std::int32_t half_extent;
  int tile_level;
  std::uint64_t* tile;  // room for `count` each
  std::uint32_t* place;
};

struct Kernels {
  const char* instruction_set;
  /// Marks free every cell that the segments pass, exactly (ray_shooting/dda_walk.inc.hpp).
  void (*walk_segments)(const TileSegments&, TileMarks&);
  /// Which of a packet's rays (a bit each) pass a box, and where (ray_shooting/packet_pass.inc.hpp).
  void (*pass_box)(const RayPacket&, const PacketBox&, std::uint32_t lanes, PassedBox&);
  /// Turns the 512 marks of a brick into bit masks (8 words each) and zeroes them; false, with no mask written, if
  /// there are none.
  bool (*take_marks)(std::uint8_t* marks, std::uint64_t* free, std::uint64_t* occupied);
  /// OctoMap's update of the marked cells, into `out` (64 values).
  OctantOutput (*update_octant)(const OctantInput&, const UpdateModel&, float* out);
  /// The octant's 64 values: one for the free cells, one for the occupied ones, 0 for the others.
  void (*fill_octant)(std::uint64_t free, float freed, std::uint64_t occupied, float hit, float* out);
  /// False if an end is not finite or outside the octree.
  bool (*make_ray_ends)(const RayEnds&);
  /// The cells of the ends that mark one, save those equal to the one before; returns how many.
  std::size_t (*find_end_cells)(const EndCells&);
  /// Which of an octant's 64 values are above the bound.
  std::uint64_t (*cells_above)(const float* log_odds, float bound);
  /// Projects directions; false if a ray is too short for it (BeamProjection).
  bool (*project_directions)(const BeamProjection&);
  /// Adds nothing but what it finds: `bounds` come in with count 0.
  void (*bound_directions)(const BeamProjection&, BeamBounds (&bounds)[6]);
  /// Replaces faces by bins, and u and v by their inverses; returns the sum of the depths.
  double (*find_bins)(const BeamProjection&, const BeamBins&);
  /// False only if no ray of the scan enters the block.
  bool (*beam_reaches)(const BeamScan&, const CellBlock&);
  /// How many rays find_rays_towards has to look at.
  std::size_t (*count_rays_towards)(const BeamScan&, const CellBlock&);
  /// All rays that pass cells of the block before their ends', and perhaps others, as segments of which only the ray is
  /// set; returns how many. `out` has room for all rays of the scan and 16 more.
  std::size_t (*find_rays_towards)(const BeamScan&, const CellBlock&, Segment* out);
  /// Clips these rays to the block, in place: leaves the segments of those that do pass, returns how many.
  std::size_t (*clip_to_block)(const BeamScan&, const CellBlock&, Segment*, std::size_t count);
  /// Of the wanted cells of an aligned 8x8x8 brick (a word per octant), exactly those that some ray of the scan passes
  /// before its end's cell.
  void (*shoot_brick)(const BeamScan&, const std::int32_t brick_cell[3], const std::uint64_t wanted[8],
                      std::uint64_t passed[8]);
  /// Answers the queries where float64 can (ray_shooting/first_stop.inc.hpp).
  void (*find_first_stops)(const StopTree&, StopQuery*, std::size_t count);
};

/// The best kernels this processor runs. The environment variable RAYVOX_SIMD (avx512, avx2, portable) forces a set;
/// throws InvalidInput if it is unknown or the processor lacks it.
const Kernels& kernels();

/// The kernels of one instruction set, null if this processor or build has none.
const Kernels* kernels_for(const char* instruction_set);

}  // namespace rayvox
