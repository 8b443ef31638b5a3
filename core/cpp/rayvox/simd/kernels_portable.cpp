#include <cstdint>

#include "rayvox/simd/exact_decisions.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox::portable {
namespace {

#include "rayvox/simd/lanes_portable.hpp"
// clang-format off
#include "rayvox/octree/octant_update.inc.hpp"
#include "rayvox/ray_shooting/beam_project.inc.hpp"
#include "rayvox/ray_shooting/beam_view.inc.hpp"
#include "rayvox/ray_shooting/beam_cells.inc.hpp"
#include "rayvox/ray_shooting/beam_shoot.inc.hpp"
#include "rayvox/ray_shooting/ray_clip.inc.hpp"
#include "rayvox/ray_shooting/dda_walk.inc.hpp"
#include "rayvox/ray_shooting/ray_ends.inc.hpp"
#include "rayvox/ray_shooting/packet_pass.inc.hpp"
#include "rayvox/ray_shooting/first_stop.inc.hpp"
// clang-format on

bool take_marks(std::uint8_t* marks, std::uint64_t* free, std::uint64_t* occupied) {
  std::uint64_t any = 0;
  for (int word = 0; word < 64; ++word) {
    std::uint64_t eight;
    __builtin_memcpy(&eight, marks + 8 * word, sizeof eight);
    any |= eight;
  }
  if (!any) return false;
  for (int octant = 0; octant < 8; ++octant) {
    free[octant] = occupied[octant] = 0;
    for (int cell = 0; cell < 64; ++cell) {
      std::uint8_t& mark = marks[64 * octant + cell];
      free[octant] |= static_cast<std::uint64_t>(mark == TileMarks::free) << cell;
      occupied[octant] |= static_cast<std::uint64_t>(mark == TileMarks::occupied) << cell;
      mark = TileMarks::none;
    }
  }
  return true;
}

}  // namespace

extern const Kernels table;
const Kernels table{.instruction_set = "portable",
                    .walk_segments = walk_segments<Lanes>,
                    .pass_box = pass_box<Lanes>,
                    .take_marks = take_marks,
                    .update_octant = update_octant<Lanes>,
                    .make_ray_ends = make_ray_ends,
                    .cells_above = cells_above<Lanes>,
                    .project_directions = project_directions,
                    .bound_directions = bound_directions<Lanes>,
                    .beam_reaches = beam_reaches,
                    .count_rays_towards = count_rays_towards,
                    .clip_to_block = clip_to_block<WideLanes>,
                    .shoot_brick = shoot_brick<Lanes>,
                    .find_first_stops = find_first_stops};

}  // namespace rayvox::portable
