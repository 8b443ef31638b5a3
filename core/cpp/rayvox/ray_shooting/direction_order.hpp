#pragma once
#include <cstdint>
#include <vector>

#include "rayvox/ray_shooting/scan_rays.hpp"

namespace rayvox {

/// The rays' indices, ordered so that neighbours point in nearly the same direction whatever order the sensor gave:
/// along a Z-order curve over the octahedral map of the sphere, 256 x 256 cells.
std::vector<std::uint32_t> order_by_direction(const ScanRays& rays, int workers);

}  // namespace rayvox
