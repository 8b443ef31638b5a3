#include <immintrin.h>

#include "lanes_probe.hpp"

namespace lanes_probe::avx512 {
namespace {
#include "rayvox/simd/collision_lanes_avx512.hpp"
}

Output run(const Input& in) { return probe<CollisionLanes>(in); }

}  // namespace lanes_probe::avx512
