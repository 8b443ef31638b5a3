#pragma once
// The traversals of two hierarchies and the tests of one against voxels, once per instruction set, from the same
// sources (collision/ and map_collision/*.inc.hpp), chosen at run time as kernels.hpp says. Their translation units may
// call nothing inline that the rest of the program shares.
#include <cstddef>
#include <cstdint>

#include "rayvox/collision/bvh_view.hpp"
#include "rayvox/collision/neural_gas.hpp"
#include "rayvox/map_collision/placed_boxes.hpp"

namespace rayvox {

/// Directions of a k-DOP's orientations, in the order in which nodes keep their own slabs.
struct alignas(64) OrientationRows {
  float coordinate[3][32];
};

/// Where one mesh lies in the other's frame, and how to enclose its slabs in the other's axes: the support value there
/// of the opposite of orientation o is at most the sum over j of coefficient[j][o] times the support value index[j][o]
/// here (Zachmann 1998). So its negative is what a volume's slab o must reach if the two overlap.
struct alignas(64) FrameChange {
  float coefficient[3][32];
  std::int32_t index[3][32];           // into a node's own slabs
  std::int32_t block_row[3][32];       // into a block's rows
  double rotation[9], translation[3];  // to = rotation * from + translation
  float rotation_f32[9], translation_f32[3];
};

/// The same for hybrid traversal's slabs, about the meshes' centres and in a's unit: slab o of a must reach at least
/// base[o] plus the sum over j of coefficient[j][o] times b's slab index[j][o] if the two overlap.
struct alignas(64) KdopAlignment {
  float base[32], coefficient[3][32];
  std::int32_t index[3][32];
};

struct RelativePose {
  FrameChange a_to_b, b_to_a;
  KdopAlignment kdop;  // for hybrid traversal
  const OrientationRows* orientations;
  float margin_m;  // more than float32 rounding takes from any bound
};

struct TraversalCounts {
  std::uint64_t node_pairs = 0;      // pairs of bounding volumes tested
  std::uint64_t axis_tests = 0;      // axes looked at, once per vector test
  std::uint64_t triangle_pairs = 0;  // pairs of triangles tested
  std::uint64_t undecided = 0;       // of those, left to float64 and exact arithmetic
};

/// One query. Triangles are named by their position in leaf order.
struct TraversalQuery {
  BvhView a, b;
  const RelativePose* pose;
  std::uint64_t* stack;  // room for stack_capacity (stack.hpp) pairs
  void* context;
  bool (*touch)(void* context, std::uint32_t a, std::uint32_t b);    // decides what float32 cannot
  bool (*contact)(void* context, std::uint32_t a, std::uint32_t b);  // told of a contact; true ends the traversal
  TraversalCounts* counts;
};

/// The planes of the cones (kdop_axes.hpp).
struct ConeRows {
  int cone_count;
  const float* plane[3];
};

struct CollisionKernels {
  const char* instruction_set;
  /// Calls `contact` for every pair of triangles that touch, until it returns true. By Traversal's order; slabs of the
  /// two hierarchies in the same format.
  void (*traverse[5])(const TraversalQuery&);
  /// The cone that each of 16 directions (x, y and z in rows) lies in.
  void (*choose_cones)(const ConeRows&, const float (*direction)[16], std::int32_t* cone);
  // Batch Neural Gas (collision/neural_gas.inc.hpp). `weight_of_rank`: sixteen, aligned.
  void (*adapt_prototypes)(GasPrototypes&, const PartitionItem* items, std::size_t item_count, std::size_t samples,
                           const float* weight_of_rank);
  void (*nearest_prototypes)(const GasPrototypes&, const PartitionItem* items, std::size_t count,
                             std::uint8_t* nearest);
  // A mesh against voxels (map_collision/cube_tests.inc.hpp).
  void (*place_boxes)(const BoxBlock&, const float* rotation, float margin_m, PlacedBoxes&);
  unsigned (*boxes_meeting_cube)(const PlacedBoxes&, const LocalCube&);
  std::uint64_t (*cells_meeting_box)(const PlacedBoxes&, int lane, const LocalCells&, std::uint64_t cells);
  std::uint64_t (*values_at_least)(const float* values, float least);
  void (*place_triangles)(const TriangleBlock&, const float* rotation, TriangleBlock&);
  unsigned (*triangles_meeting_cube)(const TriangleBlock&, const LocalCube&);
  // And its distance from them (map_collision/cube_gaps.inc.hpp).
  NearLanes (*boxes_near_cube)(const PlacedBoxes&, const LocalCube&, std::uint32_t asked, float squared_limit);
  NearLanes (*triangles_near_cube)(const TriangleBlock&, const LocalCube&, std::uint32_t asked, float squared_limit);
  // Writes one answer for each of `octants`.
  void (*boxes_near_octants)(const PlacedBoxes&, const LocalOctants&, unsigned octants, std::uint32_t asked,
                             float squared_limit, NearLanes*);
  void (*triangles_near_octants)(const TriangleBlock&, const LocalOctants&, unsigned octants, std::uint32_t asked,
                                 float squared_limit, NearLanes*);
};

/// The kernels of the instruction set that kernels() chose.
const CollisionKernels& collision_kernels();
/// The kernels of one instruction set, null if this processor or build has none.
const CollisionKernels* collision_kernels_for(const char* instruction_set);

}  // namespace rayvox
