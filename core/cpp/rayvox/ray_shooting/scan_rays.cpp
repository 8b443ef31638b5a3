#include "rayvox/ray_shooting/scan_rays.hpp"

#include <atomic>
#include <limits>
#include <optional>
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

/// A scan's rays one by one: first those with an end point, then those without return.
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

  struct End {
    Vec3d position;  // voxel units
    bool is_marked;
  };
  const Vec3d& origin() const { return origin_; }
  std::size_t count() const { return scan_.points_sensor.count + scan_.no_return_sensor.count; }

  /// The end of ray i, nothing if its input is not finite or out of range.
  std::optional<End> make(std::size_t i) const {
    const bool returned = i < scan_.points_sensor.count;
    const Vec3d input = input_of(i);
    if (!is_finite(input)) return std::nullopt;
    return cut(scan_.T_map_sensor.apply(returned ? input : scan_.origin_sensor_m + input), returned);
  }

  /// The ray of `discretize`: to the centre of the voxel that holds point i; nothing if that is cut away or out of
  /// range.
  std::optional<End> make_to_centre(const Cell& cell) const {
    return cut(Vec3d{cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5} * geometry_.resolution_m(), true);
  }

  /// The cell of point i, which need not be within the scan's range.
  std::optional<Cell> cell_of_point(std::size_t i) const {
    if (!is_finite(input_of(i))) return std::nullopt;
    const Vec3d u = geometry_.to_voxel_units(scan_.T_map_sensor.apply(input_of(i)));
    if (!geometry_.contains(u)) return std::nullopt;
    return MapGeometry::cell_of(u);
  }

  /// Throws what is wrong with ray i.
  [[noreturn]] void explain(std::size_t i) const {
    const bool returned = i < scan_.points_sensor.count;
    const std::size_t index = returned ? i : i - scan_.points_sensor.count;
    const std::string name = (returned ? "points[" : "no_return[") + std::to_string(index) + "]";
    const Vec3d input = input_of(i);
    if (!is_finite(input)) throw InvalidInput(name + " is not finite: " + text(input));
    throw_out_of_range(name, scan_.T_map_sensor.apply(returned ? input : scan_.origin_sensor_m + input), geometry_);
  }

 private:
  Vec3d input_of(std::size_t i) const {
    return i < scan_.points_sensor.count ? scan_.points_sensor[i]
                                         : scan_.no_return_sensor[i - scan_.points_sensor.count];
  }

  std::optional<End> cut(Vec3d end_map_m, bool is_marked) const {
    if (scan_.max_range_m > 0) {
      const double length_m = norm(end_map_m - origin_map_m_);
      if (length_m > scan_.max_range_m) {
        end_map_m = origin_map_m_ + (end_map_m - origin_map_m_) * (scan_.max_range_m / length_m);
        is_marked = false;
      }
    }
    const End end{geometry_.to_voxel_units(end_map_m), is_marked};
    return geometry_.contains(end.position) ? std::optional(end) : std::nullopt;
  }

  const Scan& scan_;
  const MapGeometry& geometry_;
  Vec3d origin_map_m_, origin_;
};

void store(ScanRays& rays, std::size_t i, const RayMaker::End& end) {
  for (int axis = 0; axis < 3; ++axis) rays.end[axis][i] = end.position[axis];
  rays.marks_end[i] = end.is_marked;
}

void resize(ScanRays& rays, std::size_t count) {
  for (auto& coordinates : rays.end) coordinates.resize(count);
  rays.marks_end.resize(count);
}

void make_all(const RayMaker& maker, ScanRays& rays) {
  resize(rays, maker.count());
  // The lowest index that fails is the one reported, whatever the number of threads.
  std::atomic<std::size_t> first_bad{std::numeric_limits<std::size_t>::max()};
  parallel_for((maker.count() + rays_per_chunk - 1) / rays_per_chunk, [&](std::size_t chunk, int) {
    const std::size_t last = std::min(maker.count(), (chunk + 1) * rays_per_chunk);
    for (std::size_t i = chunk * rays_per_chunk; i < last; ++i) {
      if (const auto end = maker.make(i)) {
        store(rays, i, *end);
        continue;
      }
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
    std::optional<RayMaker::End> end;
    if (i < scan.points_sensor.count) {
      const std::optional<Cell> cell = maker.cell_of_point(i);
      if (!cell) maker.explain(i);
      if (!seen.insert(geometry.morton_of(*cell)).second) continue;
      end = maker.make_to_centre(*cell);
    } else {
      end = maker.make(i);
    }
    if (!end) maker.explain(i);
    store(rays, made++, *end);
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
    make_all(maker, rays);
  }
  return rays;
}

}  // namespace rayvox
