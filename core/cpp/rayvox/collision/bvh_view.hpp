#pragma once
// What the kernels see of a hierarchy: plain arrays. Everything is in metres relative to the mesh's centre.
#include <cstdint>

namespace rayvox {

/// A node: an inner node's children are consecutive nodes, a leaf's triangles consecutive in leaf order. All that the
/// test of two boxes and the next step of a traversal read: a cache line.
struct alignas(64) BvhNode {
  float origin[3];  // what this node's slabs and its children's, box and triangles are relative to
  // Oriented box centred at the origin: unit axes (rows) and half extents, thinnest first; the third axis is the cross
  // product of the first two. Rounded outward. Zero unless the hierarchy is for hybrid traversal.
  float box_axis[6];
  float box_half[3];
  std::uint32_t first;  // first child, or first triangle
  std::uint16_t count;  // children, or triangles
  std::uint16_t is_leaf;
  float slab_unit;  // slabs are stored in this unit: a power of two for half floats, 1 for float32
  float radius;     // largest distance of its triangles from the origin
};
static_assert(sizeof(BvhNode) == 64);

/// Slabs are support values: the largest product of a point with each orientation. A node's own are kept by
/// orientation (`own`, `stride` values a node: axes, then from stride / 2 on their opposites). Those of a node's
/// children lie side by side (`child`, from k * first child on; for one-vs-sixteen and four-vs-four only): for each
/// axis a row for it and a row for its opposite, each as many values as there are children. Vectors may be read beyond
/// the end.
template <class Slab>
struct SlabArrays {
  const Slab* own;
  const Slab* child;
};

/// A node's own slabs in a hierarchy for hybrid traversal: support values about the mesh's centre, in one unit for all
/// nodes, so that re-enclosing them needs no offset that depends on the node.
struct IntegerSlabs {
  const std::int16_t* own;
  float unit_m;
};

struct BvhView {
  const BvhNode* nodes;
  bool has_boxes;  // the hierarchy is for hybrid traversal
  // All null but one.
  SlabArrays<float> slabs_f32;
  SlabArrays<std::uint16_t> slabs_f16;
  IntegerSlabs slabs_i16;
  // Leaf with first triangle f and n triangles: 9 n floats from 9 f on, corner by corner and coordinate by coordinate,
  // n values each, relative to the leaf's origin and, in a hierarchy with boxes, along its box's axes.
  const float* leaf_vertices;
  int axis_count;
  int stride;  // 16 or 32
};

}  // namespace rayvox
