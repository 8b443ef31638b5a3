#include "rayvox/collision/triangle.hpp"

#include <random>
#include <vector>

#include "check.hpp"
#include "integer_triangles.hpp"
#include "rayvox/collision/exact_predicates.hpp"

using namespace rayvox;
using namespace integer_triangles;

namespace {

Triangle scaled(const IntegerTriangle& t, double scale, const Vec3d& offset) {
  Triangle out;
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] =
        Vec3d{static_cast<double>(t[i].x), static_cast<double>(t[i].y), static_cast<double>(t[i].z)} * scale + offset;
  }
  return out;
}

IntegerTriangle random_triangle(std::mt19937_64& random, long size, bool flat) {
  IntegerTriangle t;
  for (Integer3& p : t) {
    const auto coordinate = [&] {
      return static_cast<long>(random() % static_cast<unsigned long>(2 * size + 1)) - size;
    };
    p = {coordinate(), coordinate(), flat ? 0 : coordinate()};
  }
  return t;
}

}  // namespace

FACT(triangles_on_a_small_grid_touch_exactly_where_no_axis_separates_them) {
  std::mt19937_64 random(1);
  int touching = 0;
  for (int sample = 0; sample < 12000; ++sample) {
    const long size = 1 + static_cast<long>(random() % 6);
    const bool flat = sample % 4 == 0;
    const IntegerTriangle a = random_triangle(random, size, flat), b = random_triangle(random, size, flat);
    const bool expected = touch_by_axes(a, b);
    touching += expected;
    // Powers of two and offsets on the grid keep the coordinates exact.
    for (const double scale : {1.0, 0x1p-40, 0x1p30}) {
      const Vec3d offset = Vec3d{0x1p20, -0x1p21, 0x1p22} * (scale * static_cast<double>(sample % 3));
      CHECK_EQUAL(triangles_touch(scaled(a, scale, offset), scaled(b, scale, offset)), expected);
      CHECK_EQUAL(triangles_touch(scaled(b, scale, offset), scaled(a, scale, offset)), expected);
    }
  }
  CHECK(touching > 2000 && touching < 10000);
}

FACT(a_corner_one_ulp_from_a_face_is_told_from_one_on_it) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int sample = 0; sample < 3000; ++sample) {
    const double z = unit(random);
    const Triangle floor{Vec3d{-3, -3, z}, Vec3d{3, -3, z}, Vec3d{0, 4, z}};
    const auto with_tip_at = [&](double tip) {
      return Triangle{Vec3d{unit(random), unit(random), tip}, Vec3d{unit(random), unit(random), z + 1},
                      Vec3d{unit(random), unit(random), z + 2}};
    };
    CHECK(triangles_touch(floor, with_tip_at(z)));
    CHECK(!triangles_touch(floor, with_tip_at(std::nextafter(z, 2.0))));
    CHECK(triangles_touch(floor, with_tip_at(std::nextafter(z, -2.0))));
  }
}

FACT(degenerate_triangles_are_recognised) {
  const Vec3d a{0.1, 0.2, 0.3}, b{1.1, 0.2, 0.3}, c{0.6, 0.2, 0.3};
  CHECK(is_degenerate({a, b, c}));
  CHECK(is_degenerate({a, a, b}));
  CHECK(is_degenerate({a, a, a}));
  CHECK(!is_degenerate({a, b, Vec3d{0.6, std::nextafter(0.2, 1.0), 0.3}}));
}

FACT(orientation_is_exact_where_float64_rounds) {
  // det = 2^-104: products of (1 + u) and (1 - u) against 1.
  const double u = 0x1p-52;
  const Vec3d a{1 + u, 1, 0}, b{1, 1 - u, 0}, origin{0, 0, 0}, up{0, 0, 1};
  CHECK_EQUAL(orient2d(a, b, origin, 2), -1);
  CHECK_EQUAL(orient3d(up, a, b, origin), -1);
  CHECK_EQUAL(orient3d(up, b, a, origin), 1);
  CHECK_EQUAL(orient3d(up, a, a * 0.5, origin), 0);
}
