#include "rayvox/ray_shooting/scan_rays.hpp"

#include <atomic>
#include <limits>
#include <sstream>
#include <string>
#include <unordered_set>

#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"

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

  /// Stores a ray that ends there at index `at`, cut to the scan's range; false if its end is not finite or out of
  /// range.
  bool store(ScanRays& rays, std::size_t at, Vec3d end_map_m, bool marks_end) const {
    if (scan_.max_range_m > 0) {
      const double length_m = norm(end_map_m - origin_map_m_);
      if (length_m > scan_.max_range_m) {
        end_map_m = origin_map_m_ + (end_map_m - origin_map_m_) * (scan_.max_range_m / length_m);
        marks_end = false;
      }
    }
    const Vec3d end = geometry_.to_voxel_units(end_map_m);
    for (int axis = 0; axis < 3; ++axis) rays.end[axis][at] = end[axis];
    rays.marks_end[at] = marks_end;
    return geometry_.contains(end);
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
  // The lowest index that fails is the one reported, whatever the number of threads.
  std::atomic<std::size_t> first_bad{std::numeric_limits<std::size_t>::max()};
  parallel_for((maker.count() + rays_per_chunk - 1) / rays_per_chunk, [&](std::size_t chunk, int) {
    const std::size_t last = std::min(maker.count(), (chunk + 1) * rays_per_chunk);
    for (std::size_t i = chunk * rays_per_chunk; i < last; ++i) {
      if (maker.store(rays, i, maker.end_map_m(i), i < scan.points_sensor.count)) continue;
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
    if (!maker.store(rays, made, end_map_m, returned)) maker.explain(i);
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
