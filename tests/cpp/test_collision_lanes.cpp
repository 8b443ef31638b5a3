// The collision kernels' lanes, lane by lane the same in every instruction set: NaN, infinities, denormals, signed
// zeros, equal values as touching slabs have them, and lanes that hold nothing.
#include <bit>
#include <cmath>
#include <random>

#include "check.hpp"
#include "lanes_probe.hpp"
#include "rayvox/simd/collision_kernels.hpp"

using namespace lanes_probe;

namespace {

float awkward_value(std::mt19937_64& random) {
  const float special[] = {NAN,      -NAN,     INFINITY, -INFINITY, 0.0f,     -0.0f,     1e-45f,
                           -1e-45f,  1e-40f,   3.4e38f,  -3.4e38f,  65504.0f, 65520.0f,  1.0f,
                           0x1p-24f, 0x1p-14f, -1.0f,    0.5f,      1.5f,     0x1.002p0f};
  if (random() % 2) return special[random() % std::size(special)];
  return std::uniform_real_distribution<float>(-2, 2)(random);
}

Input awkward_input(std::mt19937_64& random) {
  Input in{};
  for (int i = 0; i < 16; ++i) {
    in.a[i] = awkward_value(random);
    in.b[i] = random() % 4 ? awkward_value(random) : in.a[i];
    in.c[i] = random() % 4 ? awkward_value(random) : in.b[i];
    in.half[i] = static_cast<std::uint16_t>(random());
    in.index[i] = static_cast<std::int32_t>(random() % 32);
    in.low_index[i] = static_cast<std::int32_t>(random() % 16);
  }
  for (std::int16_t& value : in.integer) value = static_cast<std::int16_t>(random());
  for (float& value : in.table) value = awkward_value(random);
  in.first = static_cast<int>(random() % 17);
  return in;
}

// NaN equals NaN, whatever its payload; zeros differ by their sign.
bool same(float x, float y) {
  return (std::isnan(x) && std::isnan(y)) || std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
}

void check_same(const Output& expected, const Output& found) {
  for (int row = 0; row < Output::rows; ++row) {
    for (int lane = 0; lane < 16; ++lane) {
      if (same(expected.row[row][lane], found.row[row][lane])) continue;
      check::fail(__FILE__, __LINE__,
                  "operation " + std::to_string(row) + ", lane " + std::to_string(lane) + ": " +
                      std::to_string(expected.row[row][lane]) + " against " + std::to_string(found.row[row][lane]));
    }
  }
  CHECK_EQUAL(found.greater, expected.greater);
  CHECK_EQUAL(found.not_less, expected.not_less);
  CHECK_EQUAL(found.both, expected.both);
  CHECK_EQUAL(found.either, expected.either);
  CHECK_EQUAL(found.first_lanes, expected.first_lanes);
}

}  // namespace

FACT(every_lane_is_the_same_in_every_instruction_set) {
  std::mt19937_64 random(1);
  for (int sample = 0; sample < 20000; ++sample) {
    const Input in = awkward_input(random);
    const Output expected = portable::run(in);
    if (rayvox::collision_kernels_for("avx2")) check_same(expected, avx2::run(in));
    if (rayvox::collision_kernels_for("avx512")) check_same(expected, avx512::run(in));
  }
}

FACT(a_comparison_with_nan_holds_in_no_lane_and_equal_values_are_not_less) {
  Input in{};
  in.first = 5;
  for (int i = 0; i < 16; ++i) {
    in.a[i] = i % 2 ? NAN : 1.0f;
    in.b[i] = i % 4 < 2 ? 1.0f : NAN;
  }
  const Output out = portable::run(in);
  CHECK_EQUAL(out.greater, 0u);
  CHECK_EQUAL(out.not_less, 0x1111u);
  CHECK_EQUAL(out.first_lanes, 0x1fu);
  for (int i = 5; i < 16; ++i) CHECK(same(out.row[8][i], 0.0f));
}
