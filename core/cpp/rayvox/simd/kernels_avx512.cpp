#include <cstdint>

#include <immintrin.h>

#include "rayvox/simd/exact_decisions.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox::avx512 {
namespace {

#include "rayvox/simd/lanes_avx512.hpp"

constexpr char instruction_set[] = "avx512";

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

#include "rayvox/simd/kernels.inc.hpp"

}  // namespace rayvox::avx512
