#include <cstdint>

#include <immintrin.h>

#include "rayvox/simd/kernels.hpp"
#include "rayvox/simd/settle_tie.hpp"

namespace rayvox::avx2 {
namespace {

#include "rayvox/simd/lanes_avx2.hpp"
// clang-format off
#include "rayvox/octree/octant_update.inc.hpp"
#include "rayvox/ray_shooting/dda_walk.inc.hpp"
// clang-format on

void take_marks(std::uint8_t* marks, std::uint64_t* free, std::uint64_t* occupied) {
  const __m256i is_free = _mm256_set1_epi8(TileMarks::free), is_occupied = _mm256_set1_epi8(TileMarks::occupied);
  const auto bits_of = [](__m256i half, __m256i value) {
    return static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(half, value)));
  };
  for (int octant = 0; octant < 8; ++octant) {
    auto* halves = reinterpret_cast<__m256i*>(marks + 64 * octant);
    const __m256i low = _mm256_loadu_si256(halves), high = _mm256_loadu_si256(halves + 1);
    free[octant] = bits_of(low, is_free) | static_cast<std::uint64_t>(bits_of(high, is_free)) << 32;
    occupied[octant] = bits_of(low, is_occupied) | static_cast<std::uint64_t>(bits_of(high, is_occupied)) << 32;
    _mm256_storeu_si256(halves, _mm256_setzero_si256());
    _mm256_storeu_si256(halves + 1, _mm256_setzero_si256());
  }
}

}  // namespace

extern const Kernels table;
const Kernels table{"avx2", walk_segments<Lanes>, take_marks, update_octant<Lanes>};

}  // namespace rayvox::avx2
