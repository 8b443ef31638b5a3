#pragma once
// Triangles with integer corners, and whether they touch, decided without rounding.
#include <algorithm>
#include <array>
#include <vector>

namespace integer_triangles {

struct Integer3 {
  long x, y, z;
};
inline Integer3 operator-(const Integer3& a, const Integer3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Integer3 cross(const Integer3& a, const Integer3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline long dot(const Integer3& a, const Integer3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

using IntegerTriangle = std::array<Integer3, 3>;

inline bool separates(const Integer3& axis, const IntegerTriangle& a, const IntegerTriangle& b) {
  long a_low = dot(axis, a[0]), a_high = a_low, b_low = dot(axis, b[0]), b_high = b_low;
  for (const Integer3& p : a) a_low = std::min(a_low, dot(axis, p)), a_high = std::max(a_high, dot(axis, p));
  for (const Integer3& p : b) b_low = std::min(b_low, dot(axis, p)), b_high = std::max(b_high, dot(axis, p));
  return a_high < b_low || b_high < a_low;
}

// By the separating axis theorem in exact integers. Every axis that can be needed is among the products of edges and
// of differences of corners, whatever is degenerate; more axes never separate what touches.
inline bool touch_by_axes(const IntegerTriangle& a, const IntegerTriangle& b) {
  std::vector<Integer3> lines;
  for (std::size_t i = 0; i < 3; ++i) {
    lines.push_back(a[(i + 1) % 3] - a[i]);
    lines.push_back(b[(i + 1) % 3] - b[i]);
    for (const Integer3& p : b) lines.push_back(p - a[i]);
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (separates(lines[i], a, b)) return false;
    for (std::size_t j = 0; j < i; ++j) {
      const Integer3 normal = cross(lines[i], lines[j]);
      if (separates(normal, a, b)) return false;
      for (const Integer3& line : lines) {
        if (separates(cross(normal, line), a, b)) return false;
      }
    }
  }
  return true;
}

}  // namespace integer_triangles
