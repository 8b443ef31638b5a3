#pragma once
// What every operation of the collision kernels' lanes gives for up to sixteen values, asked of each instruction set.
#include <cstdint>

namespace lanes_probe {

// Plain arrays: an inline function shared with other files might be compiled for the wrong instruction set.
struct Input {
  alignas(64) float a[16], b[16], c[16];
  alignas(64) std::uint16_t half[16];
  alignas(64) float table[32];
  alignas(64) std::int32_t index[16];      // below 32
  alignas(64) std::int32_t low_index[16];  // below 16
  int first;                               // lanes that hold something
};

struct Output {
  static constexpr int rows = 12;
  float row[rows][16];
  unsigned greater, not_less, both, either, first_lanes;
};

// In the lanes of the instruction set that the including file is compiled for.
template <class L>
Output probe(const Input& in) {
  Output out{};
  for (int at = 0; at < 16; at += L::width) {
    const auto a = L::load(&in.a[at]), b = L::load(&in.b[at]);
    L::store(&out.row[0][at], L::add(a, b));
    L::store(&out.row[1][at], L::subtract(a, b));
    L::store(&out.row[2][at], L::multiply(a, b));
    L::store(&out.row[3][at], L::min(a, b));
    L::store(&out.row[4][at], L::max(a, b));
    L::store(&out.row[5][at], L::abs(a));
    L::store(&out.row[6][at], L::select(L::greater(a, b), a, L::load(&in.c[at])));
    L::store(&out.row[7][at], L::load(&in.half[at]));
    L::store(&out.row[8][at], L::lookup(in.table, 16, &in.low_index[at]));
    L::store(&out.row[9][at], L::lookup(in.table, 32, &in.index[at]));
    const auto four = L::load_four(in.half);
    L::store(&out.row[10][at], L::spread(four, at / L::width));
    L::store(&out.row[11][at], L::repeat(four, at / L::width));
    out.greater |= L::bits(L::greater(a, b)) << at;
    out.not_less |= L::bits(L::not_less(a, b)) << at;
    out.both |= L::bits(L::both(L::greater(a, b), L::not_less(b, L::load(&in.c[at])))) << at;
    out.either |= L::bits(L::either(L::greater(a, b), L::greater(b, a))) << at;
    out.first_lanes |= L::bits(L::first(in.first - at < 0 ? 0 : in.first - at)) << at;
  }
  return out;
}

namespace portable {
Output run(const Input& in);
}
namespace avx2 {
Output run(const Input& in);
}
namespace avx512 {
Output run(const Input& in);
}

}  // namespace lanes_probe
