#include <cstddef>
#include <cstdint>

#include "rayvox/simd/collision_kernels.hpp"

namespace rayvox::portable {
namespace {

#include "rayvox/simd/collision_lanes_portable.hpp"

constexpr char instruction_set[] = "portable";

}  // namespace

#include "rayvox/simd/collision_kernels.inc.hpp"

}  // namespace rayvox::portable
