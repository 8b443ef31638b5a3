#pragma once
// numpy arrays in and out.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <memory>

#include "rayvox/geometry/points_view.hpp"

namespace rayvox::bindings {

namespace nb = nanobind;

using Points32 = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Points64 = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Matrix4 = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;

inline PointsView view(const Points32& points) { return {points.data(), nullptr, points.shape(0)}; }
inline PointsView view(const Points64& points) { return {nullptr, points.data(), points.shape(0)}; }

/// A numpy array of its own, written through data().
template <class T, std::size_t columns = 1>
class NewArray {
 public:
  explicit NewArray(std::size_t rows) : rows_(rows), data_(new T[rows * columns > 0 ? rows * columns : 1]) {}
  T* data() { return data_.get(); }
  nb::object release() {
    T* raw = data_.release();
    nb::capsule owner(raw, [](void* p) noexcept { delete[] static_cast<T*>(p); });
    if constexpr (columns == 1) {
      return nb::cast(nb::ndarray<nb::numpy, T, nb::ndim<1>>(raw, {rows_}, owner));
    } else {
      return nb::cast(nb::ndarray<nb::numpy, T, nb::ndim<2>>(raw, {rows_, columns}, owner));
    }
  }

 private:
  std::size_t rows_;
  std::unique_ptr<T[]> data_;
};

}  // namespace rayvox::bindings
