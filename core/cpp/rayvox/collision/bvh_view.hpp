#pragma once
// What the kernels see of a hierarchy: plain arrays. Everything is in metres relative to the mesh's centre.
#include <cstdint>

namespace rayvox {

/// A node: an inner node's children are consecutive nodes, a leaf's triangles consecutive in leaf order.
struct alignas(64) BvhNode {
  float origin[3];      // what this node's slabs and its children's, boxes and triangles are relative to
  float slab_unit;      // slabs are stored in this unit: a power of two for half floats, 1 for float32
  std::uint32_t first;  // first child, or first triangle
  std::uint16_t count;  // children, or triangles
  std::uint16_t is_leaf;
  float radius;                // largest distance of its triangles from the origin
  std::uint32_t above_leaves;  // whether its first child is a leaf
  float reserved[6];
  // Oriented box centred at the origin: unit axes (rows) and half extents, thinnest first. Rounded outward.
  float box_axis[9];
  float box_half[3];
  float reserved_box[4];
};
static_assert(sizeof(BvhNode) == 128);

/// Rows of the oriented boxes of a node's children, each as many values as there are children: what box_row says. They
/// start at box_rows * first child.
namespace box_row {
constexpr int centre = 0;  // + coordinate, relative to the parent's origin
constexpr int axis = 3;    // + 3 * j + coordinate: unit axis j, thinnest first
constexpr int half = 12;   // + j
}  // namespace box_row
constexpr int box_rows = 15;

/// Slabs are support values: the largest product of a point with each orientation. A node's own are kept by
/// orientation (`own`, `stride` values a node: axes, then from stride / 2 on their opposites). Those of a node's
/// children lie side by side (`child`, from k * first child on): for each axis a row for it and a row for its opposite,
/// each as many values as there are children. Vectors may be read beyond the end.
template <class Slab>
struct SlabArrays {
  const Slab* own;
  const Slab* child;
};

struct BvhView {
  const BvhNode* nodes;
  const float* boxes;           // null unless the hierarchy is for hybrid traversal
  SlabArrays<float> slabs_f32;  // null where slabs are half floats, and the other way round
  SlabArrays<std::uint16_t> slabs_f16;
  // Leaf with first triangle f and n triangles: 9 n floats from 9 f on, corner by corner and coordinate by coordinate,
  // n values each, relative to the leaf's origin and, in a hierarchy with boxes, along its box's axes.
  const float* leaf_vertices;
  int axis_count;
  int stride;  // 16 or 32
};

}  // namespace rayvox
