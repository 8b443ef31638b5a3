#include "rayvox/ray_shooting/embree_shooting.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <limits>

#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/crossing_order.hpp"
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

bool in_node(const Cell& cell, const ChangeableNode& node) {
  return ((cell[0] ^ node.first[0]) >> node.level | (cell[1] ^ node.first[1]) >> node.level |
          (cell[2] ^ node.first[2]) >> node.level) == 0;
}

// A cell's place in its octant.
std::uint64_t bit_of(const Cell& cell) {
  static constexpr std::uint8_t spread[4] = {0, 1, 8, 9};
  return std::uint64_t{1} << (spread[cell[0] & 3] | spread[cell[1] & 3] << 1 | spread[cell[2] & 3] << 2);
}

// Per axis, the cells of an octant in slices 4 * from + to.
constexpr auto cells_of_slices = [] {
  std::array<std::array<std::uint64_t, 16>, 3> table{};
  for (unsigned cell = 0; cell < 64; ++cell) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned slice = (cell >> axis & 1) | (cell >> (axis + 3) & 1) << 1;
      for (unsigned from = 0; from <= slice; ++from) {
        for (unsigned to = slice; to < 4; ++to) table[axis][4 * from + to] |= std::uint64_t{1} << cell;
      }
    }
  }
  return table;
}();

// All cells of an octant between two corners, both included.
std::uint64_t cells_between(const std::int32_t (&low)[3], const std::int32_t (&high)[3]) {
  std::uint64_t cells = ~std::uint64_t{0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cells &= cells_of_slices[axis][static_cast<std::size_t>(4 * low[axis] + high[axis])];
  }
  return cells;
}

// The cells that a ray frees on its way from `cell` over so many borders, all of them in one octant.
std::uint64_t cells_of_walk(const Ray& ray, Cell cell, int crossings) {
  const Vec3d direction = ray.direction();
  const Cell end = MapGeometry::cell_of(ray.end);
  std::uint64_t cells = 0;
  while (crossings > 0) {
    cells |= bit_of(cell);
    double t[3], first = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      const double border = cell[i] + (direction[axis] > 0 ? 1 : 0);
      t[axis] = cell[i] == end[i] ? std::numeric_limits<double>::infinity() : (border - ray.origin[axis]) / direction[axis];
      first = std::min(first, t[axis]);
    }
    // Each parameter carries three roundings of 2^-53; closer ones are compared exactly.
    std::uint8_t axes = 0;
    for (int axis = 0; axis < 3; ++axis) {
      axes |= static_cast<std::uint8_t>((t[axis] <= first + 0x1p-49 * first) << axis);
    }
    if (axes & (axes - 1)) axes = first_axes_to_leave(ray, cell, axes);
    for (int axis = 0; axis < 3; ++axis) {
      if (!(axes >> axis & 1)) continue;
      cell[static_cast<std::size_t>(axis)] += direction[axis] > 0 ? 1 : -1;
      --crossings;
    }
  }
  return cells;
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

  Cell end_cell(std::size_t lane) const { return MapGeometry::cell_of(rays_[indices_[lane]].end); }

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
    const std::int32_t size = std::int32_t{1} << node.level;
    PassedBox passed;
    kernels_.pass_box(packet_, seen_from_origin(node.first, {{0, 0, 0}, {size, size, size}}), lanes, passed);
    bins_.add_segments(indices_, passed, node.first, geometry_);
    add_exactly(node, passed.doubtful);
  }

  /// Marks the cells of an octant that these rays pass and that no ray has passed yet.
  void free_cells(const ChangeableNode& octant, std::uint64_t& freed, std::uint32_t lanes) {
    std::atomic_ref<std::uint64_t> shared(freed);
    std::uint64_t wanted = octant.cells & ~shared.load(std::memory_order_relaxed);
    if (!wanted) return;
    const OctantBox around = box_around(wanted);
    const PacketBox box = seen_from_origin(octant.first, around);
    lanes &= kernels_.near_box(packet_, box);
    if (!lanes) return;
    PassedBox passed;
    kernels_.pass_box(packet_, box, lanes, passed);
    std::uint64_t found = 0;
    for (std::uint32_t left = passed.lanes; left; left &= left - 1) {
      const int lane = __builtin_ctz(left);
      std::int32_t low[3], high[3];
      Cell entry;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto in = around.low[axis] + static_cast<std::int32_t>(passed.entry[axis][lane]);
        const auto out = around.low[axis] + static_cast<std::int32_t>(passed.exit[axis][lane]);
        entry[axis] = octant.first[axis] + in;
        low[axis] = std::min(in, out);
        high[axis] = std::max(in, out);
      }
      if (!(cells_between(low, high) & wanted)) continue;
      const std::uint64_t cells = cells_of_walk(rays_[indices_[lane]], entry, static_cast<int>(passed.crossings[lane]));
      found |= cells;
      wanted &= ~cells;
    }
    for (std::uint32_t left = passed.doubtful; left && wanted; left &= left - 1) {
      const std::uint64_t cells = cells_passed_exactly(octant, indices_[__builtin_ctz(left)], wanted);
      found |= cells;
      wanted &= ~cells;
    }
    found &= octant.cells;
    if (!found) return;
    const std::uint64_t fresh = found & ~shared.fetch_or(found, std::memory_order_relaxed);
    if (fresh) bins_.add_free_cells(octant.first, fresh, geometry_);
  }

 private:
  PacketBox seen_from_origin(const Cell& first, const OctantBox& box) const {
    PacketBox seen;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double origin = rays_.origin[static_cast<int>(axis)];
      const std::int32_t low = first[axis] + box.low[axis];
      seen.first[axis] = static_cast<float>(low - start_[axis]);
      seen.size[axis] = static_cast<float>(box.size[axis]);
      // Rounded once, so that the distance to a border close by keeps its relative precision.
      seen.low[axis] = static_cast<float>(low - origin);
      seen.high[axis] = static_cast<float>(low + box.size[axis] - origin);
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

  // The cells of the octant, a bit each, that the ray frees; none if it cannot pass a wanted one.
  std::uint64_t cells_passed_exactly(const ChangeableNode& octant, std::uint32_t ray, std::uint64_t wanted) const {
    const Cell end = MapGeometry::cell_of(rays_[ray].end);
    std::int32_t low[3], high[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::max(std::min(start_[axis], end[axis]) - octant.first[axis], 0);
      high[axis] = std::min(std::max(start_[axis], end[axis]) - octant.first[axis], 3);
      if (low[axis] > high[axis]) return 0;
    }
    if (!(cells_between(low, high) & wanted)) return 0;
    RayWalker walker(rays_[ray]);
    if (!walker.enter_block(octant.first, octant_level)) return 0;
    std::uint64_t cells = 0;
    while (in_node(walker.cell(), octant) && !walker.end_in_block(0)) {
      cells |= bit_of(walker.cell());
      walker.leave_block(0);
    }
    return cells;
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
  if (!lanes) return;
  auto& region = *static_cast<EmbreeRegions::Region*>(arguments->geometry_data);
  const ChangeableNode& node = region.nodes[arguments->primitive];
  auto& query = *static_cast<Query*>(arguments->context);
  if (node.level == octant_level) {
    query.free_cells(node, region.freed[arguments->primitive], lanes);
  } else {
    query.add(node, lanes);
  }
}

void cut_rays_at_changeable_nodes(const ScanRays& rays, const MapGeometry& geometry, const EmbreeRegions& regions,
                                  const Kernels& kernels, int workers, std::vector<TileBins>& bins) {
  const auto occluded = regions.library().call().Occluded16;
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
      for (std::size_t lane = 0; lane < count; ++lane) {
        if (rays.marks_end[order[first + lane]]) own.add_end(query.end_cell(lane), geometry);
      }
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
