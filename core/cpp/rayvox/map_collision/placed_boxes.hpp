#pragma once
// What the kernels of mesh-map queries read and write: sixteen boxes or triangles side by side.
#include "rayvox/collision/bvh_view.hpp"

namespace rayvox {

/// Up to sixteen oriented boxes, metres relative to the mesh's centre.
struct alignas(64) BoxBlock {
  float centre[3][16];
  float axis[3][3][16];  // [j][coordinate]: unit axis j, thinnest first
  float half[3][16];
};

/// Sixteen oriented boxes at a pose, in the map's axes, metres relative to the mesh's placed centre. Of a cube with
/// half edge h the projection on axis j reaches h * reach_per_half[j] (DESIGN section 3).
struct alignas(64) PlacedBoxes {
  float centre[3][16];
  float axis[3][3][16];  // [j][coordinate]
  float half[3][16];
  float reach_per_half[3][16];  // |axis|_1
  float extent[3][16];          // half extents along the map's axes
};

/// Sixteen triangles, corner by corner and coordinate by coordinate.
struct alignas(64) TriangleBlock {
  float corner[3][3][16];
};

/// A cube, relative to the mesh's placed centre; grown by all that rounding may take.
struct LocalCube {
  float centre[3];
  float half;
};

/// The eight octants of a cube, each a cube grown as above: octant i's centre lies `quarter` before or behind along x,
/// y and z for the bits 0, 1 and 2 of i.
struct LocalOctants {
  float centre[3];
  float quarter;
  float half;
};

/// Of sixteen boxes or triangles the least bound of the squared distance, and the lanes where it is below a limit.
struct NearLanes {
  float least;
  std::uint32_t lanes;
};

/// The 4x4x4 finest cells of an octant, relative to the mesh's placed centre; `half`, of each, is grown like
/// LocalCube's.
struct LocalCells {
  float first_centre[3];
  float edge, half;
  float per_edge;  // 1 / edge

  /// One of them, by its Morton code.
  LocalCube cube(int cell) const {
    LocalCube cube{{}, half};
    for (int c = 0; c < 3; ++c) {
      cube.centre[c] = first_centre[c] + static_cast<float>((cell >> c & 1) + 2 * (cell >> (c + 3) & 1)) * edge;
    }
    return cube;
  }
};

}  // namespace rayvox
