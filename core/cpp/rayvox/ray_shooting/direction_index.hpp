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
    BeamProjection projection;
    BeamBounds bounds[6];
    bool sortable;
    double total_depth;
    std::vector<std::uint32_t> next;  // per bin: first how many rays, then where the next goes
  };

  BeamProjection projection_of(const ScanRays& rays, const Share& share);
  void project(Share& share, const Kernels& kernels);
  void lay_out_bins();
  void count(Share& share, const Kernels& kernels);
  void place_bins();
  void sort(Share& share);
  void measure_depths(int workers);
  void find_deepest(const BeamFace& face, std::int32_t first, std::int32_t last);
  void combine_depths(const BeamFace& face);

  BeamScan scan_{};
  std::vector<Share> shares_;
  double total_depth_ = 0;
  BeamBins bins_{};
  std::uint32_t bin_count_ = 0;
  // Per ray: face, then bin; directions, then their inverses; depths.
  Array<std::uint32_t> bin_;
  Array<float> u_, v_, depth_;
  Array<std::uint32_t> bin_start_, deepest_;
  Array<float> farthest_;
  Array<BeamRay> rays_;
};

}  // namespace rayvox
