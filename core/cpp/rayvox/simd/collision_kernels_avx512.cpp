#include <cstddef>
#include <cstdint>

#include <immintrin.h>

#include "rayvox/simd/collision_kernels.hpp"

namespace rayvox::avx512 {
namespace {

#include "rayvox/simd/collision_lanes_avx512.hpp"

constexpr char instruction_set[] = "avx512";

}  // namespace

#include "rayvox/simd/collision_kernels.inc.hpp"

}  // namespace rayvox::avx512
