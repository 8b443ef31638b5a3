#include <cstdint>

#include "rayvox/simd/exact_decisions.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox::portable {
namespace {

#include "rayvox/simd/lanes_portable.hpp"

constexpr char instruction_set[] = "portable";

bool take_marks(std::uint8_t* marks, std::uint64_t* free, std::uint64_t* occupied) {
  std::uint64_t any = 0;
  for (int word = 0; word < 64; ++word) {
    std::uint64_t eight;
    __builtin_memcpy(&eight, marks + 8 * word, sizeof eight);
    any |= eight;
  }
  if (!any) return false;
  for (int octant = 0; octant < 8; ++octant) {
    free[octant] = occupied[octant] = 0;
    for (int cell = 0; cell < 64; ++cell) {
      std::uint8_t& mark = marks[64 * octant + cell];
      free[octant] |= static_cast<std::uint64_t>(mark == TileMarks::free) << cell;
      occupied[octant] |= static_cast<std::uint64_t>(mark == TileMarks::occupied) << cell;
      mark = TileMarks::none;
    }
  }
  return true;
}

}  // namespace

#include "rayvox/simd/kernels.inc.hpp"

}  // namespace rayvox::portable
