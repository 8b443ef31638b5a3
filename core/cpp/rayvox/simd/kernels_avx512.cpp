#include <cstdint>

#include <immintrin.h>

#include "rayvox/simd/exact_decisions.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox::avx512 {
namespace {

#include "rayvox/simd/lanes_avx512.hpp"
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
  __m512i octants[8], any = _mm512_setzero_si512();
  for (int octant = 0; octant < 8; ++octant) {
    octants[octant] = _mm512_loadu_si512(marks + 64 * octant);
    any = _mm512_or_si512(any, octants[octant]);
  }
  if (_mm512_test_epi64_mask(any, any) == 0) return false;
  for (int octant = 0; octant < 8; ++octant) {
    free[octant] = _mm512_cmpeq_epi8_mask(octants[octant], _mm512_set1_epi8(TileMarks::free));
    occupied[octant] = _mm512_cmpeq_epi8_mask(octants[octant], _mm512_set1_epi8(TileMarks::occupied));
    _mm512_storeu_si512(marks + 64 * octant, _mm512_setzero_si512());
  }
  return true;
}

}  // namespace

extern const Kernels table;
const Kernels table{.instruction_set = "avx512",
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

}  // namespace rayvox::avx512
