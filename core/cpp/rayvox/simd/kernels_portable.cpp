#include <cstdint>

#include "rayvox/simd/kernels.hpp"
#include "rayvox/simd/settle_tie.hpp"

namespace rayvox::portable {
namespace {

#include "rayvox/simd/lanes_portable.hpp"
// clang-format off
#include "rayvox/octree/octant_update.inc.hpp"
#include "rayvox/ray_shooting/dda_walk.inc.hpp"
#include "rayvox/ray_shooting/packet_pass.inc.hpp"
// clang-format on

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

extern const Kernels table;
const Kernels table{"portable", walk_segments<Lanes>, pass_box<Lanes>, take_marks, update_octant<Lanes>};

}  // namespace rayvox::portable
