#include <cstdint>

#include <immintrin.h>

#include "rayvox/simd/exact_decisions.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox::avx2 {
namespace {

#include "rayvox/simd/lanes_avx2.hpp"

constexpr char instruction_set[] = "avx2";

bool take_marks(std::uint8_t* marks, std::uint64_t* free, std::uint64_t* occupied) {
  auto* halves = reinterpret_cast<__m256i*>(marks);
  __m256i any = _mm256_setzero_si256();
  for (int half = 0; half < 16; ++half) any = _mm256_or_si256(any, _mm256_loadu_si256(halves + half));
  if (_mm256_testz_si256(any, any)) return false;
  const auto bits_of = [](__m256i half, std::uint8_t value) {
    const __m256i same = _mm256_cmpeq_epi8(half, _mm256_set1_epi8(static_cast<char>(value)));
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(_mm256_movemask_epi8(same)));
  };
  for (int octant = 0; octant < 8; ++octant) {
    const __m256i low = _mm256_loadu_si256(halves + 2 * octant), high = _mm256_loadu_si256(halves + 2 * octant + 1);
    free[octant] = bits_of(low, TileMarks::free) | bits_of(high, TileMarks::free) << 32;
    occupied[octant] = bits_of(low, TileMarks::occupied) | bits_of(high, TileMarks::occupied) << 32;
  }
  for (int half = 0; half < 16; ++half) _mm256_storeu_si256(halves + half, _mm256_setzero_si256());
  return true;
}

}  // namespace

#include "rayvox/simd/kernels.inc.hpp"

}  // namespace rayvox::avx2
