#include "rayvox/simd/collision_kernels.hpp"

#include <cstring>

#include "rayvox/simd/kernels.hpp"

namespace rayvox {

namespace portable {
extern const CollisionKernels collision_table;
}
#ifdef RAYVOX_X86_KERNELS
namespace avx2 {
extern const CollisionKernels collision_table;
}
namespace avx512 {
extern const CollisionKernels collision_table;
}
#endif

const CollisionKernels* collision_kernels_for(const char* instruction_set) {
  if (!kernels_for(instruction_set)) return nullptr;
#ifdef RAYVOX_X86_KERNELS
  if (std::strcmp(instruction_set, "avx512") == 0) return &avx512::collision_table;
  // Every processor with AVX2 that was ever made converts half floats too, but the flag is its own.
  if (std::strcmp(instruction_set, "avx2") == 0) {
    return __builtin_cpu_supports("f16c") ? &avx2::collision_table : &portable::collision_table;
  }
#endif
  return &portable::collision_table;
}

const CollisionKernels& collision_kernels() {
  static const CollisionKernels* const chosen = collision_kernels_for(kernels().instruction_set);
  return *chosen;
}

}  // namespace rayvox
