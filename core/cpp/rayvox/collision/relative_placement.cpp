#include "rayvox/collision/relative_placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "rayvox/error.hpp"
#include "rayvox/geometry/expansion.hpp"
#include "rayvox/geometry/rotation.hpp"

namespace rayvox {
namespace {

// Bounds what float32 rounding of node positions, rotations and their products takes from any bound, relative to the
// sum of the meshes' radii.
constexpr double margin_of_radii = 0x1p-18;
constexpr double least_margin_m = 1e-12;

// sum r[i] c[i] + t - o, with twice the precision of float64 until the last rounding.
double precise_offset(const double* r, const Vec3d& c, double t, double o) {
  double sum = t, error = 0;
  const auto add = [&](double value) {
    const SumAndError s = two_sum(sum, value);
    sum = s.sum;
    error += s.error;
  };
  add(-o);
  for (int i = 0; i < 3; ++i) {
    const SumAndError p = two_product(r[i], c[i]);
    add(p.sum);
    error += p.error;
  }
  return sum + error;
}

void set_frame_change(FrameChange& change, const double* rotation, const double* translation) {
  for (int i = 0; i < 9; ++i) change.rotation_f32[i] = static_cast<float>(change.rotation[i] = rotation[i]);
  for (int i = 0; i < 3; ++i) change.translation_f32[i] = static_cast<float>(change.translation[i] = translation[i]);
}

void set_inverse(FrameChange& inverse, const Placement& placement) {
  const double* t = placement.translation;
  double rotation[9], translation[3];
  invert_rotation(placement.rotation, rotation);
  for (int i = 0; i < 3; ++i) {
    translation[i] = -(rotation[3 * i] * t[0] + rotation[3 * i + 1] * t[1] + rotation[3 * i + 2] * t[2]);
  }
  set_frame_change(inverse, rotation, translation);
}

using Coefficients = std::array<double, 3>;

Coefficients coefficients_in(const AxisCone& cone, const Vec3d& direction) {
  Coefficients c;
  for (std::size_t j = 0; j < 3; ++j) {
    const Vec3d& dual = cone.dual[j];
    c[j] = dual.x * direction.x + dual.y * direction.y + dual.z * direction.z;
  }
  return c;
}

double least(const Coefficients& c) { return std::min({c[0], c[1], c[2]}); }

struct InCone {
  const AxisCone* cone;
  Coefficients coefficients;
};

// `chosen` was found in float32: where a direction lies near a border between cones, it may be the neighbour.
InCone cone_of(const std::vector<AxisCone>& cones, int chosen, const Vec3d& direction) {
  const AxisCone& likely = cones[static_cast<std::size_t>(chosen)];
  const Coefficients found = coefficients_in(likely, direction);
  if (least(found) >= 0) return {&likely, found};
  const AxisCone& nearest = *std::max_element(cones.begin(), cones.end(), [&](const AxisCone& x, const AxisCone& y) {
    return least(coefficients_in(x, direction)) < least(coefficients_in(y, direction));
  });
  return {&nearest, coefficients_in(nearest, direction)};
}

}  // namespace

PairTables::PairTables(const KdopBvh& a, const KdopBvh& b, const CollisionKernels& kernels)
    : a_(a), b_(b), kernels_(kernels) {
  if (a.options().traversal != b.options().traversal) {
    throw InvalidInput("the two hierarchies are built for different traversals");
  }
  if (a.options().slabs != b.options().slabs) throw InvalidInput("the two hierarchies' slabs differ in format");
  const KdopAxes& axes = a.options().axes;
  if (!(axes == b.options().axes)) throw InvalidInput("the two hierarchies' k-DOPs have different axes");
  const int half = a.view().stride / 2, n = axes.count();
  for (int o = 0; o < 2 * n; ++o) {
    const int slot = o < n ? o : half + o - n;
    for (int c = 0; c < 3; ++c) orientations_.coordinate[c][slot] = static_cast<float>(axes.orientation(o)[c]);
  }
  const std::size_t count = axes.cones().size();
  cone_planes_.resize(3 * count);
  cones_.cone_count = static_cast<int>(count);
  for (std::size_t c = 0; c < 3; ++c) {
    cones_.plane[c] = cone_planes_.data() + c * count;
    for (std::size_t i = 0; i < count; ++i) {
      cone_planes_[c * count + i] = static_cast<float>(axes.cones()[i].plane[static_cast<int>(c)]);
    }
  }
}

std::optional<Placement> PairTables::place(const RigidTransform& T_a_b) const {
  const double* r = T_a_b.rotation();
  const Vec3d &t = T_a_b.translation(), &ca = a_.mesh().centre_m(), &cb = b_.mesh().centre_m();
  const Vec3d rough = T_a_b.apply(cb) - ca;
  const double magnitude = norm(t) + norm(ca) + norm(cb);
  // A rotation that passed validation lengthens by less than 1e-4.
  const double reach = a_.mesh().radius_m() + b_.mesh().radius_m() * (1 + 1e-4);
  if (norm(rough) > reach * (1 + 1e-6) + 1e-14 * magnitude) return std::nullopt;
  Placement placement;
  std::copy_n(r, 9, placement.rotation);
  for (int i = 0; i < 3; ++i) placement.translation[i] = precise_offset(r + 3 * i, cb, t[i], ca[i]);
  return placement;
}

void PairTables::prepare(const Placement& placement, RelativePose& pose) const {
  const double reach = a_.mesh().radius_m() + b_.mesh().radius_m();
  const double deviation = deviation_from_rotation(placement.rotation);
  pose.margin_m = static_cast<float>((margin_of_radii + 4 * deviation) * reach + least_margin_m);
  pose.orientations = &orientations_;
  set_frame_change(pose.b_to_a, placement.rotation, placement.translation);
  set_inverse(pose.a_to_b, placement);
  enclose_slabs(pose.b_to_a);
  if (a_.options().traversal == Traversal::hybrid)
    align_kdops(pose);
  else
    enclose_slabs(pose.a_to_b);
}

void PairTables::align_kdops(RelativePose& pose) const {
  const FrameChange& change = pose.b_to_a;
  const BvhView a = a_.view(), b = b_.view();
  const float per_unit = 1 / a.slabs_i16.unit_m, scale = -b.slabs_i16.unit_m * per_unit;
  const float* t = change.translation_f32;
  for (int i = 0; i < a.stride; ++i) {
    const auto& axis = orientations_.coordinate;
    const float moved = axis[0][i] * t[0] + axis[1][i] * t[1] + axis[2][i] * t[2];
    pose.kdop.base[i] = (moved - pose.margin_m) * per_unit;
    for (int j = 0; j < 3; ++j) {
      pose.kdop.coefficient[j][i] = scale * change.coefficient[j][i];
      pose.kdop.index[j][i] = change.index[j][i];
    }
  }
}

void PairTables::enclose_slabs(FrameChange& change) const {
  const KdopAxes& axes = a_.options().axes;
  const int n = axes.count(), half = a_.view().stride / 2;
  const double* r = change.rotation;
  // n . (R x) = (R^T n) . x: where each axis of the other frame points here.
  alignas(64) float direction[3][16] = {};
  Vec3d exact[16];
  for (int i = 0; i < n; ++i) {
    const Vec3d& axis = axes[i];
    for (int c = 0; c < 3; ++c) {
      exact[i][c] = r[c] * axis.x + r[3 + c] * axis.y + r[6 + c] * axis.z;
      direction[c][i] = static_cast<float>(exact[i][c]);
    }
  }
  std::int32_t chosen[16];
  kernels_.choose_cones(cones_, direction, chosen);
  std::fill_n(&change.coefficient[0][0], 96, 0.0f);
  std::fill_n(&change.index[0][0], 96, 0);
  std::fill_n(&change.block_row[0][0], 96, 0);
  for (int i = 0; i < n; ++i) {
    const auto [cone, parts] = cone_of(axes.cones(), chosen[i], exact[i]);
    for (std::size_t j = 0; j < 3; ++j) {
      const int reversed = cone->corner[j] >= n, corner = cone->corner[j] - reversed * n;
      // On a border between cones rounding makes a coefficient a negative number of the order of 1e-16.
      const auto coefficient = static_cast<float>(std::max(parts[j], 0.0));
      // Slot i is reached by what the opposite of axis i supports, slot half + i by what axis i does.
      change.coefficient[j][i] = change.coefficient[j][half + i] = coefficient;
      change.index[j][half + i] = reversed * half + corner;
      change.index[j][i] = (1 - reversed) * half + corner;
      change.block_row[j][half + i] = 2 * corner + reversed;
      change.block_row[j][i] = 2 * corner + 1 - reversed;
    }
  }
}

std::size_t PairTables::stack_capacity() const {
  // A traversal takes one pair at a time and pushes the children of both, or up to sixteen and pushes those of one of
  // each. Pairs lie in the order of their level, deepest last, and a level grows only when all of it was taken.
  constexpr std::size_t most_taken = 16;
  const auto branches_a = static_cast<std::size_t>(a_.options().branching_factor);
  const auto branches_b = static_cast<std::size_t>(b_.options().branching_factor);
  const std::size_t levels = static_cast<std::size_t>(a_.depth() + b_.depth() + 1);
  return levels * std::max(branches_a * branches_b, most_taken * std::max(branches_a, branches_b)) + most_taken;
}

}  // namespace rayvox
