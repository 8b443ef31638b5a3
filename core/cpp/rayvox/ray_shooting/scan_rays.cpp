#include "rayvox/ray_shooting/scan_rays.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {
namespace {

constexpr std::size_t rays_per_chunk = 4096;

std::string text(const Vec3d& p) {
  std::ostringstream out;
  out.precision(9);
  out << "(" << p.x << ", " << p.y << ", " << p.z << ")";
  return out.str();
}

[[noreturn]] void throw_out_of_range(const std::string& what, const Vec3d& point_map_m, const MapGeometry& geometry) {
  const double reach_m = geometry.half_extent() * geometry.resolution_m();
  throw OutOfRange(what + " is at " + text(point_map_m) + " m in the map, beyond the octree's range of +-" +
                   std::to_string(reach_m) + " m");
}

/// Makes a scan's rays: first those with an end point, then those without return.
class RayMaker {
 public:
  RayMaker(const Scan& scan, const MapGeometry& geometry) : scan_(scan), geometry_(geometry) {
    if (!is_finite(scan.origin_sensor_m)) throw InvalidInput("origin is not finite: " + text(scan.origin_sensor_m));
    if (!(scan.max_range_m >= 0)) {
      throw InvalidInput("max_range_m must be positive, got " + std::to_string(scan.max_range_m));
    }
    origin_map_m_ = scan.T_map_sensor.apply(scan.origin_sensor_m);
    origin_ = geometry.to_voxel_units(origin_map_m_);
    if (!geometry.contains(origin_)) throw_out_of_range("origin", origin_map_m_, geometry);
  }

  const Vec3d& origin() const { return origin_; }
  std::size_t count() const { return scan_.points_sensor.count + scan_.no_return_sensor.count; }

  /// Where ray i ends, metres in the map, before it is cut.
  Vec3d end_map_m(std::size_t i) const {
    const std::size_t points = scan_.points_sensor.count;
    return scan_.T_map_sensor.apply(i < points ? scan_.points_sensor[i]
                                               : scan_.origin_sensor_m + scan_.no_return_sensor[i - points]);
  }

  /// Makes rays [first, last), which must all be with an end point or all without, from index `at` on; false if one is
  /// not finite or out of range.
  bool make(std::size_t first, std::size_t last, std::size_t at, ScanRays& rays) const {
    const std::size_t points = scan_.points_sensor.count;
    const bool returned = first < points;
    const PointsView& view = returned ? scan_.points_sensor : scan_.no_return_sensor;
    const std::size_t in_view = 3 * (returned ? first : first - points);
    RayEnds part = settings(returned);
    part.f32 = view.f32 ? view.f32 + in_view : nullptr;
    part.f64 = view.f64 ? view.f64 + in_view : nullptr;
    part.count = last - first;
    if (!returned) copy(scan_.origin_sensor_m, part.offset);
    return make(part, at, rays);
  }

  /// Makes rays to these points of the map (n x 3, metres, in range) from index `at` on.
  void make_to(const double* ends_map_m, std::size_t count, std::size_t at, ScanRays& rays) const {
    RayEnds part = settings(true);
    copy_rotation(RigidTransform{}, part);
    part.f64 = ends_map_m;
    part.count = count;
    make(part, at, rays);
  }

  /// Throws what is wrong with ray i.
  [[noreturn]] void explain(std::size_t i) const {
    const std::size_t points = scan_.points_sensor.count;
    const bool returned = i < points;
    const std::string name = (returned ? "points[" : "no_return[") + std::to_string(returned ? i : i - points) + "]";
    const Vec3d input = returned ? scan_.points_sensor[i] : scan_.no_return_sensor[i - points];
    if (!is_finite(input)) throw InvalidInput(name + " is not finite: " + text(input));
    throw_out_of_range(name, end_map_m(i), geometry_);
  }

 private:
  static void copy(const Vec3d& from, double (&to)[3]) {
    for (int axis = 0; axis < 3; ++axis) to[axis] = from[axis];
  }
  static void copy_rotation(const RigidTransform& from, RayEnds& to) {
    std::copy(std::begin(from.rotation()), std::end(from.rotation()), to.rotation);
    copy(from.translation(), to.translation);
  }
  RayEnds settings(bool returned) const {
    RayEnds part{};
    copy_rotation(scan_.T_map_sensor, part);
    copy(origin_map_m_, part.origin_m);
    part.max_range_m = scan_.max_range_m;
    part.resolution_m = geometry_.resolution_m();
    part.half_extent = geometry_.half_extent();
    part.returned = returned;
    return part;
  }
  static bool make(RayEnds& part, std::size_t at, ScanRays& rays) {
    for (int axis = 0; axis < 3; ++axis) part.end[axis] = rays.end[axis].data() + at;
    part.marks_end = rays.marks_end.data() + at;
    return kernels().make_ray_ends(part);
  }

  const Scan& scan_;
  const MapGeometry& geometry_;
  Vec3d origin_map_m_, origin_;
};

void resize(ScanRays& rays, std::size_t count) {
  for (auto& coordinates : rays.end) coordinates.resize(count);
  rays.marks_end.resize(count);
}

std::size_t chunk_count(std::size_t rays) { return (rays + rays_per_chunk - 1) / rays_per_chunk; }

// Calls make(from, to) for chunks of the scan's rays [first, last), in parallel; where it returns false, throws what is
// wrong with the first ray for which it does, whatever the number of threads.
template <class Make>
void make_in_chunks(const RayMaker& maker, std::size_t first, std::size_t last, const Make& make) {
  std::atomic<std::size_t> first_bad{last};
  parallel_for(chunk_count(last - first), [&](std::size_t chunk, int) {
    const std::size_t from = first + chunk * rays_per_chunk, to = std::min(last, from + rays_per_chunk);
    if (make(from, to)) return;
    for (std::size_t i = from; i < to; ++i) {
      if (make(i, i + 1)) continue;
      for (std::size_t seen = first_bad; i < seen && !first_bad.compare_exchange_weak(seen, i);) {
      }
      return;
    }
  });
  if (first_bad < last) maker.explain(first_bad);
}

void make_all(const Scan& scan, const RayMaker& maker, ScanRays& rays) {
  resize(rays, maker.count());
  make_in_chunks(maker, 0, maker.count(), [&](std::size_t from, std::size_t to) {
    const std::size_t border = std::clamp(scan.points_sensor.count, from, to);
    return (from == border || maker.make(from, border, from, rays)) &&
           (border == to || maker.make(border, to, border, rays));
  });
}

// The cells that the scan's points lie in.
ScanRays::Array<Cell> cells_of_points(const Scan& scan, const MapGeometry& geometry) {
  Scan uncut = scan;
  uncut.max_range_m = 0;
  const RayMaker maker(uncut, geometry);
  ScanRays::Array<Cell> cells(scan.points_sensor.count);
  make_in_chunks(maker, 0, cells.size(), [&](std::size_t from, std::size_t to) {
    ScanRays part;
    resize(part, to - from);
    if (!maker.make(from, to, 0, part)) return false;
    for (std::size_t i = from; i < to; ++i) cells[i] = MapGeometry::cell_of(part[i - from].end);
    return true;
  });
  return cells;
}

// Cells seen so far: a hash table with open addressing.
class CellSet {
 public:
  /// True if the cell is new.
  bool insert(const Cell& cell) {
    const auto bits = [&](std::size_t axis) { return static_cast<std::uint64_t>(cell[axis]) & 0x1fffff; };
    const std::uint64_t key = bits(0) | bits(1) << 21 | bits(2) << 42;
    if (key == latest_) return false;  // as of most neighbours
    latest_ = key;
    std::uint64_t& slot = slot_of(key);
    if (slot == key) return false;
    slot = key;
    if (2 * ++count_ > slots_.size()) grow();
    return true;
  }

 private:
  static constexpr std::uint64_t none = ~std::uint64_t{0};

  std::uint64_t& slot_of(std::uint64_t key) {
    std::size_t at = key * 0x9e3779b97f4a7c15u >> (64 - std::countr_zero(slots_.size()));
    while (slots_[at] != none && slots_[at] != key) at = (at + 1) & (slots_.size() - 1);
    return slots_[at];
  }
  void grow() {
    std::vector<std::uint64_t> before(4 * slots_.size(), none);
    before.swap(slots_);
    for (const std::uint64_t key : before) {
      if (key != none) slot_of(key) = key;
    }
  }

  std::vector<std::uint64_t> slots_ = std::vector<std::uint64_t>(4096, none);
  std::size_t count_ = 0;
  std::uint64_t latest_ = none;
};

// The centres (n x 3, metres) of the cells, each once, in the order in which they first come.
std::vector<double> distinct_centres(const ScanRays::Array<Cell>& cells, const MapGeometry& geometry) {
  CellSet seen;
  std::vector<double> centres_m;
  for (const Cell& cell : cells) {
    if (!seen.insert(cell)) continue;
    for (const std::int32_t coordinate : cell) centres_m.push_back((coordinate + 0.5) * geometry.resolution_m());
  }
  return centres_m;
}

// One ray for each cell that holds a measured point, before it is cut, to the cell's centre.
void make_one_per_voxel(const Scan& scan, const RayMaker& maker, const MapGeometry& geometry, ScanRays& rays) {
  const std::vector<double> centres_m = distinct_centres(cells_of_points(scan, geometry), geometry);
  const std::size_t points = scan.points_sensor.count, made = centres_m.size() / 3;
  resize(rays, made + scan.no_return_sensor.count);
  parallel_for(chunk_count(made), [&](std::size_t chunk, int) {
    const std::size_t first = chunk * rays_per_chunk, last = std::min(made, first + rays_per_chunk);
    maker.make_to(centres_m.data() + 3 * first, last - first, first, rays);
  });
  make_in_chunks(maker, points, maker.count(),
                 [&](std::size_t from, std::size_t to) { return maker.make(from, to, made + (from - points), rays); });
}

}  // namespace

ScanRays prepare_scan(const Scan& scan, const MapGeometry& geometry) {
  const RayMaker maker(scan, geometry);
  if (maker.count() == 0) throw InvalidInput("empty scan: neither points nor rays without return");
  if (maker.count() > std::numeric_limits<std::uint32_t>::max()) throw InvalidInput("more than 2^32 rays in one scan");
  ScanRays rays;
  rays.origin = maker.origin();
  if (scan.discretize) {
    make_one_per_voxel(scan, maker, geometry, rays);
  } else {
    make_all(scan, maker, rays);
  }
  return rays;
}

}  // namespace rayvox
