#pragma once
// A real number as an unevaluated sum of non-overlapping float64 components of increasing magnitude (Shewchuk 1997).
#include <cmath>

namespace rayvox {

struct SumAndError {
  double sum, error;
};

inline SumAndError two_sum(double a, double b) {
  const double sum = a + b, b_virtual = sum - a;
  return {sum, (a - (sum - b_virtual)) + (b - b_virtual)};
}

inline SumAndError two_product(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

/// Holds sums and products exactly as long as they fit `capacity` components.
template <int capacity>
struct Expansion {
  double component[capacity];
  int count = 0;

  void push(double value) {
    if (value != 0) component[count++] = value;
  }
  /// Shewchuk's Grow-Expansion.
  void add(double value) {
    const int before = count;
    count = 0;
    for (int i = 0; i < before; ++i) {
      const SumAndError s = two_sum(value, component[i]);
      push(s.error);
      value = s.sum;
    }
    push(value);
  }
  /// The sign of the sum is the sign of its largest component.
  int sign() const { return count == 0 ? 0 : component[count - 1] > 0 ? 1 : -1; }
};

/// a - b, at most two components.
inline Expansion<2> difference(double a, double b) {
  const SumAndError d = two_sum(a, -b);
  Expansion<2> out;
  out.push(d.error);
  out.push(d.sum);
  return out;
}

template <int n, int m>
Expansion<n + m> operator+(const Expansion<n>& a, const Expansion<m>& b) {
  Expansion<n + m> sum;
  for (int i = 0; i < a.count; ++i) sum.push(a.component[i]);
  for (int i = 0; i < b.count; ++i) sum.add(b.component[i]);
  return sum;
}

template <int n>
Expansion<n> operator-(Expansion<n> a) {
  for (int i = 0; i < a.count; ++i) a.component[i] = -a.component[i];
  return a;
}

template <int n, int m>
Expansion<n + m> operator-(const Expansion<n>& a, const Expansion<m>& b) {
  return a + (-b);
}

/// The product, as the sum of all products of components.
template <int n, int m>
Expansion<2 * n * m> operator*(const Expansion<n>& a, const Expansion<m>& b) {
  Expansion<2 * n * m> sum;
  for (int i = 0; i < a.count; ++i) {
    for (int j = 0; j < b.count; ++j) {
      const SumAndError p = two_product(a.component[i], b.component[j]);
      sum.add(p.error);
      sum.add(p.sum);
    }
  }
  return sum;
}

}  // namespace rayvox
