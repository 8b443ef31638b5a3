#include "rayvox/ray_shooting/scan_rays.hpp"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <unordered_set>

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

  /// Makes rays [first, last), which must all be with an end point or all without, at the same indices; false if one
  /// is not finite or out of range.
  bool make(std::size_t first, std::size_t last, ScanRays& rays) const {
    const std::size_t points = scan_.points_sensor.count;
    const bool returned = first < points;
    const PointsView& view = returned ? scan_.points_sensor : scan_.no_return_sensor;
    const std::size_t at = 3 * (returned ? first : first - points);
    RayEnds part = settings(returned);
    part.f32 = view.f32 ? view.f32 + at : nullptr;
    part.f64 = view.f64 ? view.f64 + at : nullptr;
    part.count = last - first;
    if (!returned) copy(scan_.origin_sensor_m, part.offset);
    return make(part, first, rays);
  }

  /// Makes one ray that ends at a point of the map, metres, at index `at`.
  bool make_one(const Vec3d& end_map_m, bool returned, std::size_t at, ScanRays& rays) const {
    const double point[3] = {end_map_m.x, end_map_m.y, end_map_m.z};
    RayEnds part = settings(returned);
    copy_rotation(RigidTransform{}, part);
    part.f64 = point;
    part.count = 1;
    return make(part, at, rays);
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

void make_all(const Scan& scan, const RayMaker& maker, ScanRays& rays) {
  resize(rays, maker.count());
  const std::size_t points = scan.points_sensor.count;
  // The lowest index that fails is the one reported, whatever the number of threads.
  std::atomic<std::size_t> first_bad{std::numeric_limits<std::size_t>::max()};
  parallel_for((maker.count() + rays_per_chunk - 1) / rays_per_chunk, [&](std::size_t chunk, int) {
    const std::size_t first = chunk * rays_per_chunk, last = std::min(maker.count(), first + rays_per_chunk);
    const std::size_t border = std::clamp(points, first, last);
    if ((first == border || maker.make(first, border, rays)) && (border == last || maker.make(border, last, rays)))
      return;
    for (std::size_t i = first; i < last; ++i) {
      if (maker.make(i, i + 1, rays)) continue;
      for (std::size_t seen = first_bad; i < seen && !first_bad.compare_exchange_weak(seen, i);) {
      }
      return;
    }
  });
  if (first_bad < maker.count()) maker.explain(first_bad);
}

void make_one_per_voxel(const Scan& scan, const RayMaker& maker, const MapGeometry& geometry, ScanRays& rays) {
  resize(rays, maker.count());
  std::unordered_set<std::uint64_t> seen;
  seen.reserve(scan.points_sensor.count);
  std::size_t made = 0;
  for (std::size_t i = 0; i < maker.count(); ++i) {
    const bool returned = i < scan.points_sensor.count;
    Vec3d end_map_m = maker.end_map_m(i);
    if (returned) {
      const Vec3d u = geometry.to_voxel_units(end_map_m);
      if (!geometry.contains(u)) maker.explain(i);
      const Cell cell = MapGeometry::cell_of(u);
      if (!seen.insert(geometry.morton_of(cell)).second) continue;
      end_map_m = Vec3d{cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5} * geometry.resolution_m();
    }
    if (!maker.make_one(end_map_m, returned, made, rays)) maker.explain(i);
    ++made;
  }
  resize(rays, made);
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
