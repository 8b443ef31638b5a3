#include "rayvox/ray_shooting/crossing_order.hpp"

#include "brute_force.hpp"
#include "check.hpp"

using namespace rayvox;
using brute_force::Integer;

namespace {

// The same order from integers alone.
int exact_order(const Ray& ray, const Crossing& a, const Crossing& b) {
  const auto numerator = [&](const Crossing& c) {
    return brute_force::exact(c.border) - brute_force::exact(ray.origin[c.axis]);
  };
  const auto direction = [&](const Crossing& c) {
    return brute_force::exact(ray.end[c.axis]) - brute_force::exact(ray.origin[c.axis]);
  };
  Integer na = numerator(a), nb = numerator(b), da = direction(a), db = direction(b);
  if (da < 0) na = -na, da = -da;
  if (db < 0) nb = -nb, db = -db;
  const Integer difference = na * db - nb * da;
  if (difference != 0) return difference < 0 ? -1 : 1;
  return static_cast<int>(direction(a) < 0) - static_cast<int>(direction(b) < 0);
}

int sign(int v) { return (v > 0) - (v < 0); }

}  // namespace

FACT(the_order_of_crossings_is_exact_on_and_beside_cell_borders) {
  std::mt19937_64 random(1);
  for (int sample = 0; sample < 200000; ++sample) {
    const Ray ray = brute_force::awkward_ray(random, 6);
    const int i = sample % 3, j = (sample + 1) % 3;
    if (ray.origin[i] == ray.end[i] || ray.origin[j] == ray.end[j]) continue;
    const auto ahead = [&](int axis, int steps) {
      return ray.end[axis] > ray.origin[axis] ? std::ceil(ray.origin[axis]) + steps
                                              : std::floor(ray.origin[axis]) - steps;
    };
    const Crossing a{i, ahead(i, sample % 5)}, b{j, ahead(j, sample % 7)};
    CHECK_EQUAL(sign(compare_crossings(ray, a, b)), exact_order(ray, a, b));
  }
}

FACT(crossings_that_differ_by_less_than_a_rounding_are_told_apart) {
  // Along the diagonal, one coordinate moved by one unit in its last place.
  const double origin = 0.1;
  const Ray same{{origin, origin, 0}, {7.3, 7.3, 0}};
  CHECK_EQUAL(compare_crossings(same, {0, 5}, {1, 5}), 0);
  const Ray later_y{{origin, std::nextafter(origin, 0.0), 0}, {7.3, std::nextafter(7.3, 0.0), 0}};
  CHECK(compare_crossings(later_y, {0, 5}, {1, 5}) < 0);
  const Ray earlier_y{{origin, std::nextafter(origin, 1.0), 0}, {7.3, std::nextafter(7.3, 8.0), 0}};
  CHECK(compare_crossings(earlier_y, {0, 5}, {1, 5}) > 0);
}

FACT(coordinates_as_small_as_the_map_lets_through_do_not_underflow) {
  constexpr double tiny = 0x1p-200;
  const Ray ray{{-tiny, -2 * tiny, 0}, {tiny, tiny, 0}};
  // x crosses 0 at t = 1/2, y at t = 2/3.
  CHECK(compare_crossings(ray, {0, 0}, {1, 0}) < 0);
}

FACT(an_upward_axis_crosses_before_a_downward_one_at_the_same_point) {
  const Ray ray{{0.5, 1.5, 0}, {1.5, 0.5, 0}};
  CHECK_EQUAL(int{first_axes_to_leave(ray, {0, 1, 0}, 0b011)}, 0b001);
  const Ray diagonal{{0.5, 0.5, 0}, {1.5, 1.5, 0}};
  CHECK_EQUAL(int{first_axes_to_leave(diagonal, {0, 0, 0}, 0b011)}, 0b011);
}
