#include "rayvox/ray_shooting/direction_index.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t least_rays_per_share = 2048;
constexpr std::size_t most_shares = 8;  // each has counters of its own for all bins
constexpr std::size_t padding = 16;     // what vectors may read beyond an array's end
constexpr float rays_per_bin = 2;
constexpr std::int32_t rows_per_task = 32;
constexpr std::int32_t most_bins_along = 1 << (max_beam_levels - 1);

// float32 cannot tell on which side of a border the origin lies.
bool too_close_to_border(const Vec3d& origin) {
  for (int axis = 0; axis < 3; ++axis) {
    const double off = std::abs(origin[axis] - std::nearbyint(origin[axis]));
    if (off != 0 && off < 0x1p-60) return true;
  }
  return false;
}

// Square bins, few rays each, over the directions that occur.
void lay_out(const BeamBounds& bounds, BeamFace& face) {
  const float width = bounds.u[1] - bounds.u[0], height = bounds.v[1] - bounds.v[0];
  const float longer = std::max(width, height), count = static_cast<float>(bounds.count);
  const float bin = std::max({std::sqrt(rays_per_bin * width * height / count), rays_per_bin * longer / count,
                              1.001f * longer / static_cast<float>(most_bins_along), min_beam_bin});
  face.u_low = bounds.u[0];
  face.v_low = bounds.v[0];
  face.bins_per_unit = 1 / bin;
  face.columns = std::min(most_bins_along, static_cast<std::int32_t>(width * face.bins_per_unit) + 1);
  face.rows = std::min(most_bins_along, static_cast<std::int32_t>(height * face.bins_per_unit) + 1);
}

}  // namespace

bool DirectionIndex::build(const ScanRays& rays, int workers, const Kernels& kernels) {
  if (too_close_to_border(rays.origin)) return false;
  const std::size_t share_count =
      std::clamp<std::size_t>(rays.count() / least_rays_per_share, 1, std::min<std::size_t>(most_shares, workers));
  shares_.resize(share_count);
  for (std::size_t i = 0; i < share_count; ++i) {
    shares_[i].first = rays.count() * i / share_count;
    shares_[i].last = rays.count() * (i + 1) / share_count;
  }
  for (auto* array : {&u_, &v_, &depth_}) array->resize(rays.count() + padding);
  bin_.resize(rays.count() + padding);
  rays_.resize(rays.count() + padding);
  for (Share& share : shares_) share.projection = projection_of(rays, share);

  const auto for_each_share = [&](const auto& work) {
    parallel_for(share_count, workers, [&](std::size_t i, int) { work(shares_[i]); });
  };
  for_each_share([&](Share& share) { project(share, kernels); });
  if (!std::all_of(shares_.begin(), shares_.end(), [](const Share& share) { return share.sortable; })) return false;
  lay_out_bins();
  for_each_share([&](Share& share) { count(share, kernels); });
  total_depth_ = 0;
  for (const Share& share : shares_) total_depth_ += share.total_depth;
  place_bins();
  for_each_share([&](Share& share) { sort(share); });
  measure_depths(workers);

  for (int axis = 0; axis < 3; ++axis) {
    scan_.origin[axis] = rays.origin[axis];
    scan_.origin_cell[axis] = std::floor(rays.origin[axis]);
    scan_.end[axis] = rays.end[axis].data();
  }
  scan_.rays = rays_.data();
  return true;
}

BeamProjection DirectionIndex::projection_of(const ScanRays& rays, const Share& share) {
  const std::size_t first = share.first;
  return {{rays.origin.x, rays.origin.y, rays.origin.z},
          {rays.end[0].data() + first, rays.end[1].data() + first, rays.end[2].data() + first},
          bin_.data() + first,
          u_.data() + first,
          v_.data() + first,
          depth_.data() + first,
          share.last - first};
}

void DirectionIndex::project(Share& share, const Kernels& kernels) {
  std::fill(std::begin(share.bounds), std::end(share.bounds), BeamBounds{});
  share.sortable = kernels.project_directions(share.projection);
  if (share.sortable) kernels.bound_directions(share.projection, share.bounds);
}

void DirectionIndex::lay_out_bins() {
  scan_.face_count = 0;
  bin_count_ = 0;
  std::uint32_t level_start = 0;
  for (int f = 0; f < 6; ++f) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    BeamBounds all{{infinity, -infinity}, {infinity, -infinity}, 0};
    for (const Share& share : shares_) {
      const BeamBounds& part = share.bounds[f];
      all.count += part.count;
      all.u[0] = std::min(all.u[0], part.u[0]);
      all.u[1] = std::max(all.u[1], part.u[1]);
      all.v[0] = std::min(all.v[0], part.v[0]);
      all.v[1] = std::max(all.v[1], part.v[1]);
    }
    if (!all.count) continue;
    BeamFace& face = scan_.face[scan_.face_count++];
    face.axis = f / 2;
    face.u_axis = f / 2 == 0 ? 1 : 0;
    face.v_axis = f / 2 == 2 ? 1 : 2;
    face.sign = f % 2 ? -1.0f : 1.0f;
    lay_out(all, face);
    bins_.u_low[f] = face.u_low;
    bins_.v_low[f] = face.v_low;
    bins_.bins_per_unit[f] = face.bins_per_unit;
    bins_.first[f] = bin_count_;
    bins_.columns[f] = static_cast<std::uint32_t>(face.columns);
    bins_.last_column[f] = static_cast<float>(face.columns - 1);
    bins_.last_row[f] = static_cast<float>(face.rows - 1);
    bin_count_ += static_cast<std::uint32_t>(face.columns * face.rows);
    face.levels = 0;
    for (std::int32_t columns = face.columns, rows = face.rows;; columns = (columns + 1) / 2, rows = (rows + 1) / 2) {
      face.level_start[face.levels] = level_start;
      face.level_columns[face.levels] = static_cast<std::uint32_t>(columns);
      level_start += static_cast<std::uint32_t>(columns * rows);
      ++face.levels;
      if (columns == 1 && rows == 1) break;
    }
  }
  bin_start_.resize(bin_count_ + 1);
  deepest_.resize(bin_count_);
  farthest_.resize(level_start + padding);
  for (int f = 0; f < scan_.face_count; ++f) {
    BeamFace& face = scan_.face[f];
    face.bin_start = bin_start_.data() + bins_.first[2 * face.axis + (face.sign < 0)];
    face.farthest = farthest_.data();
    face.deepest = deepest_.data() + (face.bin_start - bin_start_.data());
  }
}

void DirectionIndex::count(Share& share, const Kernels& kernels) {
  share.total_depth = kernels.find_bins(share.projection, bins_);
  share.next.assign(bin_count_, 0);
  for (std::size_t i = share.first; i < share.last; ++i) ++share.next[bin_[i]];
}

void DirectionIndex::place_bins() {
  std::uint32_t at = 0;
  for (std::uint32_t bin = 0; bin < bin_count_; ++bin) {
    bin_start_[bin] = at;
    for (Share& share : shares_) {
      const std::uint32_t rays = share.next[bin];
      share.next[bin] = at;
      at += rays;
    }
  }
  bin_start_[bin_count_] = at;
}

void DirectionIndex::sort(Share& share) {
  const std::uint32_t* bin = bin_.data();
  const float *u = u_.data(), *v = v_.data(), *depth = depth_.data();
  std::uint32_t* next = share.next.data();
  BeamRay* rays = rays_.data();
  for (std::size_t i = share.first; i < share.last; ++i) {
    rays[next[bin[i]]++] = {u[i], v[i], depth[i], static_cast<std::uint32_t>(i)};
  }
}

void DirectionIndex::measure_depths(int workers) {
  // Vectors may read these beyond the last ray; none of them passes anything.
  std::fill_n(rays_.data() + bin_start_[bin_count_], padding, BeamRay{0, 0, 0, 0});
  struct Rows {
    const BeamFace* face;
    std::int32_t first, last;
  };
  std::vector<Rows> tasks;
  for (const BeamFace& face : std::span(scan_.face, static_cast<std::size_t>(scan_.face_count))) {
    for (std::int32_t row = 0; row < face.rows; row += rows_per_task) {
      tasks.push_back({&face, row, std::min(row + rows_per_task, face.rows)});
    }
  }
  parallel_for(tasks.size(), workers, [&](std::size_t task, int) {
    const Rows& rows = tasks[task];
    find_deepest(*rows.face, rows.first * rows.face->columns, rows.last * rows.face->columns);
  });
  for (int f = 0; f < scan_.face_count; ++f) combine_depths(scan_.face[f]);
}

// The deepest ray of each bin of one face in [first, last).
void DirectionIndex::find_deepest(const BeamFace& face, std::int32_t first, std::int32_t last) {
  std::uint32_t* deepest_of = deepest_.data() + (face.bin_start - bin_start_.data());
  float* finest = farthest_.data() + face.level_start[0];
  for (std::int32_t bin = first; bin < last; ++bin) {
    std::uint32_t deepest = bin_start_[bin_count_];  // passes nothing
    for (std::uint32_t at = face.bin_start[bin]; at < face.bin_start[bin + 1]; ++at) {
      if (rays_[at].depth > rays_[deepest].depth) deepest = at;
    }
    deepest_of[bin] = deepest;
    finest[bin] = rays_[deepest].depth;
  }
}

// The pyramid over one face's bins.
void DirectionIndex::combine_depths(const BeamFace& face) {
  std::int32_t columns = face.columns, rows = face.rows;
  for (int level = 1; level < face.levels; ++level) {
    const float* below = farthest_.data() + face.level_start[level - 1];
    float* bins = farthest_.data() + face.level_start[level];
    for (std::int32_t row = 0; row < (rows + 1) / 2; ++row) {
      const float* upper = below + static_cast<std::size_t>(2 * row) * columns;
      const float* lower = 2 * row + 1 < rows ? upper + columns : upper;
      for (std::int32_t column = 0; column < (columns + 1) / 2; ++column) {
        const std::int32_t left = 2 * column, right = std::min(left + 1, columns - 1);
        *bins++ = std::max(std::max(upper[left], upper[right]), std::max(lower[left], lower[right]));
      }
    }
    columns = (columns + 1) / 2;
    rows = (rows + 1) / 2;
  }
}

std::size_t DirectionIndex::bytes() const {
  std::size_t total = 0;
  for (const auto* array : {&u_, &v_, &depth_, &farthest_}) total += array->capacity();
  for (const auto* array : {&bin_, &bin_start_, &deepest_}) total += array->capacity();
  for (const Share& share : shares_) total += share.next.capacity();
  return total * sizeof(float) + rays_.capacity() * sizeof(BeamRay);
}

}  // namespace rayvox
