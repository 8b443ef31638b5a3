#include <cstdint>

#include <immintrin.h>

#include "rayvox/simd/kernels.hpp"
#include "rayvox/simd/settle_tie.hpp"

namespace rayvox::avx512 {
namespace {

#include "rayvox/simd/lanes_avx512.hpp"
// clang-format off
#include "rayvox/octree/octant_update.inc.hpp"
#include "rayvox/ray_shooting/dda_walk.inc.hpp"
#include "rayvox/ray_shooting/packet_pass.inc.hpp"
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
const Kernels table{"avx512", walk_segments<Lanes>, pass_box<Lanes>, take_marks, update_octant<Lanes>};

}  // namespace rayvox::avx512
