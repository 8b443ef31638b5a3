#include "rayvox/ray_shooting/scan_rays.hpp"

#include <sstream>
#include <string>
#include <unordered_set>

#include "rayvox/error.hpp"

namespace rayvox {
namespace {

std::string text(const Vec3d& p) {
  std::ostringstream out;
  out.precision(9);
  out << "(" << p.x << ", " << p.y << ", " << p.z << ")";
  return out.str();
}

class Preparation {
 public:
  Preparation(const Scan& scan, const MapGeometry& geometry) : scan_(scan), geometry_(geometry) {
    if (!is_finite(scan.origin_sensor_m)) throw InvalidInput("origin is not finite: " + text(scan.origin_sensor_m));
    if (!(scan.max_range_m >= 0))
      throw InvalidInput("max_range_m must be positive, got " + std::to_string(scan.max_range_m));
    origin_map_m_ = scan.T_map_sensor.apply(scan.origin_sensor_m);
    rays_.origin = to_cells(origin_map_m_, "origin", 0);
    const std::size_t count = scan.points_sensor.count + scan.no_return_sensor.count;
    if (count == 0) throw InvalidInput("empty scan: neither points nor rays without return");
    for (auto& coordinates : rays_.end) coordinates.reserve(count);
    rays_.marks_end.reserve(count);
  }

  void add_points() {
    std::unordered_set<std::uint64_t> seen;
    for (std::size_t i = 0; i < scan_.points_sensor.count; ++i) {
      const Vec3d point = scan_.points_sensor[i];
      if (!is_finite(point)) throw InvalidInput("points[" + std::to_string(i) + "] is not finite: " + text(point));
      Vec3d point_map_m = scan_.T_map_sensor.apply(point);
      if (scan_.discretize) {
        const Cell cell = MapGeometry::cell_of(to_cells(point_map_m, "points", i));
        if (!seen.insert(geometry_.morton_of(cell)).second) continue;
        point_map_m = Vec3d{cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5} * geometry_.resolution_m();
      }
      add_ray(point_map_m, true, "points", i);
    }
  }

  void add_rays_without_return() {
    for (std::size_t i = 0; i < scan_.no_return_sensor.count; ++i) {
      const Vec3d reach = scan_.no_return_sensor[i];
      if (!is_finite(reach)) throw InvalidInput("no_return[" + std::to_string(i) + "] is not finite: " + text(reach));
      add_ray(scan_.T_map_sensor.apply(scan_.origin_sensor_m + reach), false, "no_return", i);
    }
  }

  ScanRays take() { return std::move(rays_); }

 private:
  void add_ray(Vec3d end_map_m, bool marks_end, const char* array, std::size_t index) {
    const double length_m = norm(end_map_m - origin_map_m_);
    if (scan_.max_range_m > 0 && length_m > scan_.max_range_m) {
      end_map_m = origin_map_m_ + (end_map_m - origin_map_m_) * (scan_.max_range_m / length_m);
      marks_end = false;
    }
    const Vec3d end = to_cells(end_map_m, array, index);
    for (int axis = 0; axis < 3; ++axis) rays_.end[axis].push_back(end[axis]);
    rays_.marks_end.push_back(marks_end);
  }

  Vec3d to_cells(const Vec3d& point_map_m, const char* array, std::size_t index) const {
    const Vec3d u = geometry_.to_voxel_units(point_map_m);
    if (geometry_.contains(u)) return u;
    const double reach_m = geometry_.half_extent() * geometry_.resolution_m();
    throw OutOfRange(std::string(array) + "[" + std::to_string(index) + "] is at " + text(point_map_m) +
                     " m in the map, beyond the octree's range of +-" + std::to_string(reach_m) + " m");
  }

  const Scan& scan_;
  const MapGeometry& geometry_;
  Vec3d origin_map_m_;
  ScanRays rays_;
};

}  // namespace

ScanRays prepare_scan(const Scan& scan, const MapGeometry& geometry) {
  Preparation preparation(scan, geometry);
  preparation.add_points();
  preparation.add_rays_without_return();
  return preparation.take();
}

}  // namespace rayvox
