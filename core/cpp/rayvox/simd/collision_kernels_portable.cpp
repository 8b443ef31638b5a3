#include <cstddef>
#include <cstdint>

#include "rayvox/simd/collision_kernels.hpp"

namespace rayvox::portable {
namespace {

// clang-format off
#include "rayvox/simd/collision_lanes_portable.hpp"
#include "rayvox/collision/realign.inc.hpp"
#include "rayvox/collision/triangle_filter.inc.hpp"
#include "rayvox/collision/leaf_pair.inc.hpp"
#include "rayvox/collision/traverse.inc.hpp"
#include "rayvox/collision/traverse_boxes.inc.hpp"
#include "rayvox/map_collision/cube_tests.inc.hpp"
// clang-format on

}  // namespace

extern const CollisionKernels collision_table;
const CollisionKernels collision_table{
    "portable",
    {traverse_scalar, traverse_by_orientation<CollisionLanes>, traverse_one_vs_sixteen<CollisionLanes>,
     traverse_four_vs_four<CollisionLanes>, traverse_hybrid<CollisionLanes>},
    choose_cones<CollisionLanes>,
    place_boxes<CollisionLanes>,
    boxes_meeting_cube<CollisionLanes>,
    cells_meeting_box<CollisionLanes>,
    values_at_least<CollisionLanes>,
    place_triangles<CollisionLanes>,
    triangles_meeting_cube<CollisionLanes>};

}  // namespace rayvox::portable
