#include "rayvox/ray_shooting/embree_shooting.hpp"

#include <algorithm>
#include <cstdlib>

#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/direction_order.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {
namespace {

constexpr std::size_t packet_width = RayPacket::width;
constexpr std::size_t packets_per_chunk = 64;
// Shorter ways along an axis leave float32's range when inverted.
constexpr double least_direction = 0x1p-40;

int cells_apart(const Cell& a, const Cell& b) {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

// The root, alone of all nodes, does not start at a multiple of its size.
bool in_node(const Cell& cell, const ChangeableNode& node) {
  const auto outside = [&](std::size_t axis) {
    return static_cast<std::uint32_t>(cell[axis] - node.first[axis]) >> node.level;
  };
  return (outside(0) | outside(1) | outside(2)) == 0;
}

// One packet on its way through the scene; Embree carries it to the callback.
class Query : public embree::QueryContext {
 public:
  Query(const ScanRays& rays, const MapGeometry& geometry, const Kernels& kernels, TileBins& bins)
      : rays_(rays), geometry_(geometry), kernels_(kernels), bins_(bins), start_(MapGeometry::cell_of(rays.origin)) {}

  /// Lines up the rays with these indices, at most a packet; a bit is set for each that leaves its first cell.
  std::uint32_t line_up(const std::uint32_t* indices, std::size_t count) {
    std::uint32_t moving = 0;
    packet_.exact_only = 0;
    for (std::size_t lane = 0; lane < packet_width; ++lane) {
      indices_[lane] = indices[std::min(lane, count - 1)];
      std::int32_t apart = 0;
      bool hardly_moves = false;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double end = rays_.end[axis][indices_[lane]], d = end - rays_.origin[static_cast<int>(axis)];
        const std::int32_t cells = floor_to_cell(end) - start_[axis];
        packet_.direction[axis][lane] = static_cast<float>(d);
        packet_.inverse[axis][lane] = std::abs(d) < least_direction ? 0 : static_cast<float>(1 / d);
        packet_.end_cell[axis][lane] = static_cast<float>(cells);
        hardly_moves |= std::abs(d) < least_direction && d != 0;
        apart |= cells;
      }
      packet_.exact_only |= static_cast<std::uint32_t>(hardly_moves) << lane;
      moving |= static_cast<std::uint32_t>(apart != 0 && lane < count) << lane;
    }
    return moving;
  }

  /// The packet as Embree takes it.
  embree::Ray16 relative_to(const Cell& anchor) const {
    embree::Ray16 shot;
    for (std::uint32_t lane = 0; lane < packet_width; ++lane) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        shot.origin[axis][lane] = static_cast<float>(rays_.origin[static_cast<int>(axis)] - anchor[axis]);
        shot.direction[axis][lane] = static_cast<float>(packet_.direction[axis][lane]);
      }
      shot.t_near[lane] = shot.time[lane] = 0;
      shot.t_far[lane] = 1;
      shot.mask[lane] = 0xffffffff;
      shot.id[lane] = lane;
      shot.flags[lane] = 0;
    }
    return shot;
  }

  /// Takes down what these rays (a bit each) pass inside a wholly changeable node.
  void add(const ChangeableNode& node, std::uint32_t lanes) {
    if (node.level > geometry_.tile_level()) {
      add_exactly(node, lanes);
      return;
    }
    PassedBox passed;
    kernels_.pass_box(packet_, seen_from_origin(node), lanes, passed);
    bins_.add_segments(indices_, passed, node.first, geometry_);
    add_exactly(node, passed.doubtful);
  }

 private:
  PacketBox seen_from_origin(const ChangeableNode& node) const {
    PacketBox seen;
    seen.size = static_cast<float>(std::int32_t{1} << node.level);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = node.first[axis] - rays_.origin[static_cast<int>(axis)];
      const double high = node.first[axis] + (std::int32_t{1} << node.level) - rays_.origin[static_cast<int>(axis)];
      seen.first[axis] = static_cast<float>(node.first[axis] - start_[axis]);
      // Rounded once, so that the distance to a border close by keeps its relative precision.
      seen.low[axis] = static_cast<float>(low);
      seen.high[axis] = static_cast<float>(high);
    }
    return seen;
  }

  // The rays' parts inside the node, tile by tile.
  void add_exactly(const ChangeableNode& node, std::uint32_t lanes) {
    const int level = std::min(node.level, geometry_.tile_level());
    for (; lanes; lanes &= lanes - 1) {
      const std::uint32_t ray = indices_[__builtin_ctz(lanes)];
      RayWalker walker(rays_[ray]);
      if (!walker.enter_block(node.first, node.level)) continue;
      for (bool last = false; !last && in_node(walker.cell(), node);) {
        const Cell before = walker.cell();
        last = walker.end_in_block(level);
        if (!last) walker.leave_block(level);
        const int crossings = cells_apart(before, last ? walker.end_cell() : walker.cell());
        if (crossings) bins_.add_segment(ray, before, crossings, geometry_);
      }
    }
  }

  const ScanRays& rays_;
  const MapGeometry& geometry_;
  const Kernels& kernels_;
  TileBins& bins_;
  const Cell start_;
  RayPacket packet_;
  std::uint32_t indices_[packet_width];
};

}  // namespace

void take_candidates(const embree::OccludedFunctionArguments* arguments) {
  const auto* ids = static_cast<const std::uint32_t*>(arguments->rays) + embree::id_row * arguments->N;
  std::uint32_t lanes = 0;
  for (std::uint32_t i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i]) lanes |= 1u << ids[i];
  }
  const auto& region = *static_cast<const EmbreeRegions::Region*>(arguments->geometry_data);
  if (lanes) static_cast<Query*>(arguments->context)->add(region.nodes[arguments->primitive], lanes);
}

void cut_rays_at_changeable_nodes(const ScanRays& rays, const MapGeometry& geometry, const EmbreeRegions& regions,
                                  const Kernels& kernels, int workers, std::vector<TileBins>& bins) {
  const auto occluded = regions.embree().call().Occluded16;
  const std::vector<std::uint32_t> order = order_by_direction(rays, workers);
  constexpr std::size_t rays_per_chunk = packets_per_chunk * packet_width;
  parallel_for((order.size() + rays_per_chunk - 1) / rays_per_chunk, workers, [&](std::size_t chunk, int worker) {
    TileBins& own = bins[static_cast<std::size_t>(worker)];
    Query query(rays, geometry, kernels, own);
    const std::size_t last = std::min(order.size(), (chunk + 1) * rays_per_chunk);
    for (std::size_t first = chunk * rays_per_chunk; first < last; first += packet_width) {
      const std::size_t count = std::min(packet_width, last - first);
      const std::uint32_t moving = query.line_up(&order[first], count);
      alignas(64) int valid[packet_width];
      for (std::size_t lane = 0; lane < packet_width; ++lane) valid[lane] = moving >> lane & 1 ? -1 : 0;
      embree::Ray16 shot = query.relative_to(regions.anchor());
      embree::OccludedArguments arguments;
      arguments.flags = embree::query_coherent;
      arguments.context = &query;
      if (moving) occluded(valid, regions.scene(), &shot, &arguments);
    }
    own.add_ends(rays, chunk * rays_per_chunk, last, geometry, geometry.tile_level());
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
