#include <cmath>

#include "check.hpp"
#include "collision_meshes.hpp"
#include "rayvox/collision/half_float.hpp"
#include "rayvox/collision/kdop_axes.hpp"
#include "rayvox/error.hpp"

using namespace rayvox;

FACT(every_half_is_itself_and_what_lies_between_two_is_rounded_up) {
  for (unsigned bits = 0; bits < 0x10000; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    const float value = half_to_float(half);
    if (std::isnan(value) || half == 0x8000) continue;
    CHECK_EQUAL(half_to_float(half_not_below(value)), value);
    if (!std::isfinite(value)) continue;
    const float above = std::nextafter(value, INFINITY), below = std::nextafter(value, -INFINITY);
    CHECK(half_to_float(half_not_below(above)) > value);
    CHECK(half_to_float(half_not_below(below)) == value || value == -65504.0f);
  }
  CHECK_EQUAL(half_to_float(half_not_below(-INFINITY)), -INFINITY);
  CHECK_EQUAL(half_to_float(half_not_below(1e30f)), INFINITY);
}

FACT(every_direction_is_a_combination_of_three_orientations_without_negative_coefficients) {
  std::mt19937_64 random(1);
  for (const int k : {6, 8, 14, 16, 18, 24, 26, 32}) {
    const KdopAxes axes = KdopAxes::standard(k);
    CHECK_EQUAL(axes.k(), k);
    CHECK_EQUAL(axes.cones().size(), static_cast<std::size_t>(2 * k - 4));
    for (int sample = 0; sample < 2000; ++sample) {
      Vec3d d = collision_meshes::point(random);
      if (sample < k) d = axes.orientation(sample);
      double best = -1;
      Vec3d rebuilt;
      for (const AxisCone& cone : axes.cones()) {
        double least = 2;
        Vec3d sum;
        for (std::size_t j = 0; j < 3; ++j) {
          const double c = cone.dual[j].x * d.x + cone.dual[j].y * d.y + cone.dual[j].z * d.z;
          least = std::min(least, c);
          sum = sum + axes.orientation(cone.corner[j]) * c;
        }
        if (least > best) best = least, rebuilt = sum;
      }
      CHECK(best > -1e-9);
      CHECK(norm(rebuilt - d) < 1e-9);
    }
  }
}

FACT(axes_are_normalised_and_bad_ones_refused) {
  const KdopAxes axes({{2, 0, 0}, {0, 0, -5}, {1, 1, 0}});
  CHECK_EQUAL(axes[0].x, 1.0);
  CHECK_EQUAL(axes[1].z, -1.0);
  CHECK_THROWS(InvalidInput, KdopAxes({{1, 0, 0}, {0, 1, 0}}));
  CHECK_THROWS(InvalidInput, KdopAxes({{1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
  CHECK_THROWS(InvalidInput, KdopAxes({{1, 0, 0}, {0, 1, 0}, {0, 0, 0}}));
  CHECK_THROWS(InvalidInput, KdopAxes({{1, 0, 0}, {0, 1, 0}, {0, 0, NAN}}));
  CHECK_THROWS(InvalidInput, KdopAxes({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}}));
  CHECK_THROWS(InvalidInput, KdopAxes::standard(12));
  CHECK_THROWS(InvalidInput, KdopAxes(std::vector<Vec3d>(17, Vec3d{1, 0, 0})));
}
