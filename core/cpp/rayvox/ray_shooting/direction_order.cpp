#include "rayvox/ray_shooting/direction_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "rayvox/octree/morton.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t rays_per_chunk = 8192;
constexpr std::size_t cells = 256;

constexpr auto spread_in_plane = [] {
  std::array<std::uint16_t, cells> spread{};
  for (std::size_t i = 0; i < cells; ++i) {
    for (std::size_t bit = 0; bit < 8; ++bit) spread[i] |= static_cast<std::uint16_t>((i >> bit & 1) << (2 * bit));
  }
  return spread;
}();

// Cell on the octahedral map (Meyer et al. 2010) of a direction of any length.
std::uint16_t direction_code(const Vec3d& d) {
  const double length = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  if (length == 0) return 0;
  double u = d.x / length, v = d.y / length;
  if (d.z < 0) {
    const double folded = (1 - std::abs(v)) * (u < 0 ? -1 : 1);
    v = (1 - std::abs(u)) * (v < 0 ? -1 : 1);
    u = folded;
  }
  const auto cell = [](double w) { return std::min(static_cast<std::size_t>((w + 1) * (cells / 2)), cells - 1); };
  return static_cast<std::uint16_t>(spread_in_plane[cell(u)] | spread_in_plane[cell(v)] << 1);
}

}  // namespace

std::vector<std::uint32_t> order_by_direction(const ScanRays& rays, int workers) {
  std::vector<std::uint16_t> code(rays.count());
  parallel_for((rays.count() + rays_per_chunk - 1) / rays_per_chunk, workers, [&](std::size_t chunk, int) {
    const std::size_t last = std::min(rays.count(), (chunk + 1) * rays_per_chunk);
    for (std::size_t i = chunk * rays_per_chunk; i < last; ++i) code[i] = direction_code(rays[i].end - rays.origin);
  });
  std::vector<std::uint32_t> position(cells * cells + 1);
  for (const std::uint16_t c : code) ++position[c + 1u];
  for (std::size_t c = 0; c < cells * cells; ++c) position[c + 1] += position[c];
  std::vector<std::uint32_t> order(rays.count());
  for (std::size_t i = 0; i < rays.count(); ++i) order[position[code[i]]++] = static_cast<std::uint32_t>(i);
  return order;
}

}  // namespace rayvox
