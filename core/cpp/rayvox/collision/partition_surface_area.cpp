#include <algorithm>
#include <array>
#include <limits>

#include "rayvox/collision/partition.hpp"

namespace rayvox {
namespace {

constexpr int bins = 32;
constexpr float infinity = std::numeric_limits<float>::infinity();

struct Bin {
  TriangleBounds box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  std::size_t count = 0;

  void add(const TriangleBounds& b) {
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], b.low[axis]);
      box.high[axis] = std::max(box.high[axis], b.high[axis]);
    }
  }
  double cost() const {
    if (count == 0) return 0;
    const double x = box.high[0] - box.low[0], y = box.high[1] - box.low[1], z = box.high[2] - box.low[2];
    return (x * y + y * z + z * x) * static_cast<double>(count);
  }
};

struct Plane {
  double cost = std::numeric_limits<double>::infinity();
  int axis = -1, bin = 0;
  float low = 0, per_unit = 0;

  int bin_of(const PartitionItem& item) const {
    return std::clamp(static_cast<int>((item.centre[axis] - low) * per_unit), 0, bins - 1);
  }
};

void try_axis(std::span<const PartitionItem> items, std::span<const TriangleBounds> bounds, int axis, Plane& best) {
  float low = infinity, high = -infinity;
  for (const PartitionItem& item : items) {
    low = std::min(low, item.centre[axis]);
    high = std::max(high, item.centre[axis]);
  }
  if (!(high > low)) return;
  Plane plane{0, axis, 0, low, static_cast<float>(bins) / (high - low)};
  std::array<Bin, bins> bin;
  for (const PartitionItem& item : items) {
    Bin& b = bin[static_cast<std::size_t>(plane.bin_of(item))];
    b.add(bounds[item.triangle]);
    ++b.count;
  }
  std::array<double, bins> right_cost{};
  Bin right;
  for (int i = bins - 1; i > 0; --i) {
    const Bin& b = bin[static_cast<std::size_t>(i)];
    right.add(b.box);
    right.count += b.count;
    right_cost[static_cast<std::size_t>(i)] = right.cost();
  }
  Bin left;
  for (int i = 1; i < bins; ++i) {
    const Bin& b = bin[static_cast<std::size_t>(i - 1)];
    left.add(b.box);
    left.count += b.count;
    if (left.count == 0 || left.count == items.size()) continue;
    plane.cost = left.cost() + right_cost[static_cast<std::size_t>(i)];
    plane.bin = i;
    if (plane.cost < best.cost) best = plane;
  }
}

}  // namespace

std::vector<std::size_t> split_surface_area(std::span<PartitionItem> items, std::span<const TriangleBounds> bounds) {
  Plane best;
  for (int axis = 0; axis < 3; ++axis) try_axis(items, bounds, axis, best);
  if (best.axis < 0) return {items.size()};
  const auto middle = std::partition(items.begin(), items.end(),
                                     [&](const PartitionItem& item) { return best.bin_of(item) < best.bin; });
  const auto left = static_cast<std::size_t>(middle - items.begin());
  return {left, items.size() - left};
}

}  // namespace rayvox
