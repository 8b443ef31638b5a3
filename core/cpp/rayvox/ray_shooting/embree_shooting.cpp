#include "rayvox/ray_shooting/embree_shooting.hpp"

#include <algorithm>
#include <cstdlib>

#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"

namespace rayvox {
namespace {

constexpr std::size_t rays_per_chunk = 1024;

int cells_apart(const Cell& a, const Cell& b) {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

bool in_node(const Cell& cell, const ChangeableNode& node) {
  return ((cell[0] ^ node.first[0]) >> node.level | (cell[1] ^ node.first[1]) >> node.level |
          (cell[2] ^ node.first[2]) >> node.level) == 0;
}

// One ray on its way through the scene; Embree carries it to the callback.
struct Query : embree::QueryContext {
  Query(const Ray& ray, std::size_t ray_index, const MapGeometry& map_geometry, TileBins& worker_bins)
      : start(ray), index(ray_index), geometry(map_geometry), bins(worker_bins) {}

  const RayWalker start;
  const std::size_t index;
  const MapGeometry& geometry;
  TileBins& bins;

  // The ray's part inside the node, tile by tile.
  void add(const ChangeableNode& node) const {
    RayWalker walker = start;
    if (!walker.enter_block(node.first, node.level)) return;
    const int level = std::min(node.level, geometry.tile_level());
    for (bool last = false; !last && in_node(walker.cell(), node);) {
      const Cell before = walker.cell();
      last = walker.end_in_block(level);
      if (!last) walker.leave_block(level);
      const int crossings = cells_apart(before, last ? walker.end_cell() : walker.cell());
      if (crossings) bins.add_segment(index, before, crossings, geometry);
    }
  }
};

embree::Ray relative_to(const Cell& anchor, const Ray& ray) {
  const Vec3d direction = ray.direction();
  return {static_cast<float>(ray.origin.x - anchor[0]),
          static_cast<float>(ray.origin.y - anchor[1]),
          static_cast<float>(ray.origin.z - anchor[2]),
          0,
          static_cast<float>(direction.x),
          static_cast<float>(direction.y),
          static_cast<float>(direction.z),
          0,
          1,
          0xffffffff,
          0,
          0};
}

}  // namespace

void take_candidate(const embree::OccludedFunctionArguments* arguments) {
  if (!arguments->valid[0]) return;
  const auto& region = *static_cast<const EmbreeRegions::Region*>(arguments->geometry_data);
  static_cast<const Query*>(arguments->context)->add(region.nodes[arguments->primitive]);
}

void cut_rays_at_changeable_nodes(const ScanRays& rays, const MapGeometry& geometry, const EmbreeRegions& regions,
                                  int workers, std::vector<TileBins>& bins) {
  const auto occluded = regions.library().call().Occluded1;
  const std::size_t chunks = (rays.count() + rays_per_chunk - 1) / rays_per_chunk;
  parallel_for(chunks, workers, [&](std::size_t chunk, int worker) {
    TileBins& own = bins[static_cast<std::size_t>(worker)];
    const std::size_t last = std::min(rays.count(), (chunk + 1) * rays_per_chunk);
    for (std::size_t i = chunk * rays_per_chunk; i < last; ++i) {
      const Ray ray = rays[i];
      Query query(ray, i, geometry, own);
      if (query.start.cell() != query.start.end_cell()) {
        embree::Ray shot = relative_to(regions.anchor(), ray);
        embree::OccludedArguments arguments;
        arguments.context = &query;
        occluded(regions.scene(), &shot, &arguments);
      }
      if (rays.marks_end[i]) own.add_end(query.start.end_cell(), geometry);
    }
  });
}

CellBox bounds_of(const ScanRays& rays) {
  Vec3d low = rays.origin, high = rays.origin;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax_element(rays.end[axis].begin(), rays.end[axis].end());
    low[axis] = std::min(low[axis], *least);
    high[axis] = std::max(high[axis], *most);
  }
  return {MapGeometry::cell_of(low), MapGeometry::cell_of(high)};
}

}  // namespace rayvox
