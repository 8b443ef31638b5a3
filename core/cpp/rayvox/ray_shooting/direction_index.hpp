#pragma once
#include <cstdint>
#include <vector>

#include "rayvox/ray_shooting/beam_scan.hpp"
#include "rayvox/ray_shooting/scan_rays.hpp"
#include "rayvox/simd/kernels.hpp"

namespace rayvox {

/// A scan's rays sorted by direction into the bins of a BeamScan.
class DirectionIndex {
 public:
  /// False, with nothing to be asked afterwards, for the rare scans that float32 cannot sort: a ray much shorter than a
  /// voxel, or an origin so close to a voxel's border that only exact arithmetic tells on which side it lies.
  bool build(const ScanRays& rays, int workers, const Kernels& kernels);
  /// Valid until the next build, as long as the rays are.
  const BeamScan& scan() const { return scan_; }
  /// Sum of the depths of all rays' ends, in voxel units.
  double total_depth() const { return total_depth_; }
  std::size_t bytes() const;

 private:
  template <class T>
  using Array = ScanRays::Array<T>;
  struct Share {
    std::size_t first, last;
    BeamBounds bounds[6];
    bool sortable;
    double total_depth;
    std::vector<std::uint32_t> next;  // per bin: first how many rays, then where the next goes
  };

  void project(const ScanRays& rays, Share& share, const Kernels& kernels);
  void lay_out_bins(const std::vector<Share>& shares);
  void count(Share& share);
  void place_bins(std::vector<Share>& shares);
  void sort(Share& share);
  void measure_depths();

  BeamScan scan_{};
  double total_depth_ = 0;
  std::uint32_t first_bin_[6] = {}, bin_count_ = 0;
  std::int32_t view_of_face_[6] = {};
  Array<std::uint32_t> face_, bin_start_, deepest_;
  Array<float> u_, v_, depth_, farthest_;
  Array<BeamRay> rays_;
};

}  // namespace rayvox
