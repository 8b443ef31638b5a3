#pragma once
// What every operation of the collision kernels' lanes gives for up to sixteen values, asked of each instruction set.
#include <cstdint>

namespace lanes_probe {

// Plain arrays: an inline function shared with other files might be compiled for the wrong instruction set.
struct Input {
  alignas(64) float a[16], b[16], c[16];
  alignas(64) std::uint16_t half[16];
  alignas(64) std::int16_t integer[32];
  alignas(64) float table[32];
  alignas(64) std::int32_t index[16];      // below 32
  alignas(64) std::int32_t low_index[16];  // below 16
  int first;                               // lanes that hold something
};

struct Output {
  static constexpr int rows = 20;
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
    const float* quads[16];
    for (int i = 0; i < 16; ++i) quads[i] = in.table + 4 * ((3 * (at + i)) % 8);
    typename L::Float transposed[4];
    L::load_transposed(quads, 0, transposed);
    for (int c = 0; c < 4; ++c) L::store(&out.row[12 + c][at], transposed[c]);
    L::store(&out.row[16][at], L::load(&in.integer[at]));
    const typename L::template Table<32> integers(in.integer);
    L::store(&out.row[17][at], integers.lookup(&in.index[at]));
    out.greater |= L::bits(L::greater(a, b)) << at;
    out.not_less |= L::bits(L::not_less(a, b)) << at;
    out.both |= L::bits(L::both(L::greater(a, b), L::not_less(b, L::load(&in.c[at])))) << at;
    out.either |= L::bits(L::either(L::greater(a, b), L::greater(b, a))) << at;
    out.first_lanes |= L::bits(L::first(in.first - at < 0 ? 0 : in.first - at)) << at;
  }
  std::int32_t repeated[16], numbers[16];
  L::store_set_bits(in.half[0], in.first, repeated, numbers);
  for (int i = 0; i < __builtin_popcount(in.half[0]); ++i) {
    out.row[18][i] = static_cast<float>(repeated[i]);
    out.row[19][i] = static_cast<float>(numbers[i]);
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
