// What every instruction set instantiates from the same sources, and its table. Included once per instruction set,
// inside its namespace, after its CollisionLanes and its name, `instruction_set`.

namespace {

// clang-format off
#include "rayvox/collision/neural_gas.inc.hpp"
#include "rayvox/collision/realign.inc.hpp"
#include "rayvox/collision/triangle_filter.inc.hpp"
#include "rayvox/collision/leaf_pair.inc.hpp"
#include "rayvox/collision/kdop_overlap.inc.hpp"
#include "rayvox/collision/traverse.inc.hpp"
#include "rayvox/collision/traverse_boxes.inc.hpp"
#include "rayvox/map_collision/cube_tests.inc.hpp"
#include "rayvox/map_collision/cube_gaps.inc.hpp"
// clang-format on

}  // namespace

extern const CollisionKernels collision_table;
const CollisionKernels collision_table{
    .instruction_set = instruction_set,
    .traverse = {traverse_scalar, traverse_by_orientation<CollisionLanes>, traverse_one_vs_sixteen<CollisionLanes>,
                 traverse_four_vs_four<CollisionLanes>, traverse_hybrid<CollisionLanes>},
    .choose_cones = choose_cones<CollisionLanes>,
    .adapt_prototypes = adapt_prototypes<CollisionLanes>,
    .nearest_prototypes = nearest_prototypes<CollisionLanes>,
    .place_boxes = place_boxes<CollisionLanes>,
    .boxes_meeting_cube = boxes_meeting_cube<CollisionLanes>,
    .cells_meeting_box = cells_meeting_box<CollisionLanes>,
    .values_at_least = values_at_least<CollisionLanes>,
    .place_triangles = place_triangles<CollisionLanes>,
    .triangles_meeting_cube = triangles_meeting_cube<CollisionLanes>,
    .boxes_near_cube = boxes_near_cube<CollisionLanes>,
    .triangles_near_cube = triangles_near_cube<CollisionLanes>,
    .boxes_near_octants = boxes_near_octants<CollisionLanes>,
    .triangles_near_octants = triangles_near_octants<CollisionLanes>};
