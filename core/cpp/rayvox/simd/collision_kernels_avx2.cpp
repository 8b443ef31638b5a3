#include <cstddef>
#include <cstdint>

#include <immintrin.h>

#include "rayvox/simd/collision_kernels.hpp"

namespace rayvox::avx2 {
namespace {

#include "rayvox/simd/collision_lanes_avx2.hpp"

constexpr char instruction_set[] = "avx2";

}  // namespace

#include "rayvox/simd/collision_kernels.inc.hpp"

}  // namespace rayvox::avx2
