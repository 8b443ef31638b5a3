#pragma once
// Min, Han, Kim 2021, Algorithm 1, with Embree in place of the GPU: which nodes of the scene does each ray cross?
#include <vector>

#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/embree_regions.hpp"
#include "rayvox/ray_shooting/scan_rays.hpp"
#include "rayvox/ray_shooting/tile_bins.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// Fills each worker's bins with the rays' parts inside the scene's nodes, and with their ends. Embree proposes the
/// nodes in float32; whether a ray passes one, and from which cell to which, is decided exactly.
void cut_rays_at_changeable_nodes(const ScanRays& rays, const MapGeometry& geometry, const EmbreeRegions& regions,
                                  const Kernels& kernels, int workers, std::vector<TileBins>& bins);

/// The cells between the rays' lowest and highest coordinates.
CellBox bounds_of(const ScanRays& rays);

/// Embree's occlusion callback: takes down the node for those rays that pass it, and lets them go on.
void take_candidates(const embree::OccludedFunctionArguments* arguments);

}  // namespace rayvox
