#include "rayvox/simd/settle_tie.hpp"

#include "rayvox/ray_shooting/crossing_order.hpp"

namespace rayvox {

std::uint8_t settle_tie(const TileSegments& tile, std::uint32_t ray, const std::int32_t cell[3],
                        std::uint8_t candidates) {
  const Ray exact{{tile.origin[0], tile.origin[1], tile.origin[2]},
                  {tile.end[0][ray], tile.end[1][ray], tile.end[2][ray]}};
  return first_axes_to_leave(exact, {cell[0], cell[1], cell[2]}, candidates);
}

}  // namespace rayvox
