#include "lanes_probe.hpp"

namespace lanes_probe::portable {
namespace {
#include "rayvox/simd/collision_lanes_portable.hpp"
}

Output run(const Input& in) { return probe<CollisionLanes>(in); }

}  // namespace lanes_probe::portable
