#include "rayvox/simd/kernels.hpp"

#include <cstdlib>
#include <cstring>
#include <string>

#include "rayvox/error.hpp"

namespace rayvox {

namespace portable {
extern const Kernels table;
}
#ifdef RAYVOX_X86_KERNELS
namespace avx2 {
extern const Kernels table;
}
namespace avx512 {
extern const Kernels table;
}
#endif

const Kernels* kernels_for(const char* instruction_set) {
#ifdef RAYVOX_X86_KERNELS
  const bool has_avx2 =
      __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (has_avx512 && std::strcmp(instruction_set, "avx512") == 0) return &avx512::table;
  if (has_avx2 && std::strcmp(instruction_set, "avx2") == 0) return &avx2::table;
#endif
  return std::strcmp(instruction_set, "portable") == 0 ? &portable::table : nullptr;
}

const Kernels& kernels() {
  static const Kernels* const chosen = [] {
    if (const char* forced = std::getenv("RAYVOX_SIMD"); forced && *forced) {
      const Kernels* set = kernels_for(forced);
      if (!set)
        throw InvalidInput(std::string("RAYVOX_SIMD=") + forced + ": not known here; use avx512, avx2 or portable");
      return set;
    }
    for (const char* name : {"avx512", "avx2"}) {
      if (const Kernels* set = kernels_for(name)) return set;
    }
    return kernels_for("portable");
  }();
  return *chosen;
}

}  // namespace rayvox
