// What every instruction set instantiates from the same sources, and its table. Included once per instruction set,
// inside its namespace, after its Lanes and WideLanes, its take_marks and its name, `instruction_set`.

namespace {

// clang-format off
#include "rayvox/octree/octant_update.inc.hpp"
#include "rayvox/ray_shooting/beam_project.inc.hpp"
#include "rayvox/ray_shooting/beam_view.inc.hpp"
#include "rayvox/ray_shooting/beam_cells.inc.hpp"
#include "rayvox/ray_shooting/beam_shoot.inc.hpp"
#include "rayvox/ray_shooting/ray_clip.inc.hpp"
#include "rayvox/ray_shooting/end_cells.inc.hpp"
#include "rayvox/ray_shooting/dda_walk.inc.hpp"
#include "rayvox/ray_shooting/ray_ends.inc.hpp"
#include "rayvox/ray_shooting/packet_pass.inc.hpp"
#include "rayvox/ray_shooting/first_stop.inc.hpp"
// clang-format on

}  // namespace

extern const Kernels table;
const Kernels table{.instruction_set = instruction_set,
                    .walk_segments = walk_segments<Lanes>,
                    .pass_box = pass_box<Lanes>,
                    .take_marks = take_marks,
                    .update_octant = update_octant<Lanes>,
                    .fill_octant = fill_octant<Lanes>,
                    .make_ray_ends = make_ray_ends,
                    .find_end_cells = find_end_cells,
                    .cells_above = cells_above<Lanes>,
                    .project_directions = project_directions<Lanes>,
                    .bound_directions = bound_directions<Lanes>,
                    .find_bins = find_bins<Lanes>,
                    .beam_reaches = beam_reaches,
                    .count_rays_towards = count_rays_towards<Lanes>,
                    .find_rays_towards = find_rays_towards<Lanes>,
                    .clip_to_block = clip_to_block<WideLanes>,
                    .shoot_brick = shoot_brick<Lanes>,
                    .find_first_stops = find_first_stops};
