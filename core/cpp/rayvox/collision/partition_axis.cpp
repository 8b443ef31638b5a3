#include <algorithm>
#include <cmath>

#include "rayvox/collision/partition.hpp"

namespace rayvox {
namespace {

struct CentreBox {
  float low[3], high[3];
};

CentreBox box_of(std::span<const PartitionItem> items) {
  CentreBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = box.high[axis] = items[0].centre[axis];
    for (const PartitionItem& item : items) {
      box.low[axis] = std::min(box.low[axis], item.centre[axis]);
      box.high[axis] = std::max(box.high[axis], item.centre[axis]);
    }
  }
  return box;
}

int longest_axis(std::span<const PartitionItem> items) {
  const CentreBox box = box_of(items);
  int longest = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (box.high[axis] - box.low[axis] > box.high[longest] - box.low[longest]) longest = axis;
  }
  return longest;
}

// Equal centres are ordered by triangle, so that the result does not depend on the order they come in.
void select(std::span<PartitionItem> items, std::size_t nth, int axis) {
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(nth), items.end(),
                   [axis](const PartitionItem& a, const PartitionItem& b) {
                     return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis]
                                                             : a.triangle < b.triangle;
                   });
}

void select_parts(std::span<PartitionItem> items, std::span<const std::size_t> sizes, int axis) {
  if (sizes.size() < 2) return;
  const std::size_t half = sizes.size() / 2;
  std::size_t before = 0;
  for (std::size_t i = 0; i < half; ++i) before += sizes[i];
  select(items, before, axis);
  select_parts(items.first(before), sizes.first(half), axis);
  select_parts(items.subspan(before), sizes.subspan(half), axis);
}

void halve(std::span<PartitionItem> items, int parts, std::vector<std::size_t>& sizes) {
  if (parts < 2 || items.size() < 2) {
    sizes.push_back(items.size());
    return;
  }
  const int left = parts / 2;
  const std::size_t middle = std::clamp<std::size_t>(
      items.size() * static_cast<std::size_t>(left) / static_cast<std::size_t>(parts), 1, items.size() - 1);
  select(items, middle, longest_axis(items));
  halve(items.first(middle), left, sizes);
  halve(items.subspan(middle), parts - left, sizes);
}

}  // namespace

std::vector<std::size_t> split_evenly(std::size_t count, int parts) {
  const std::size_t n = std::min<std::size_t>(count, static_cast<std::size_t>(parts));
  std::vector<std::size_t> sizes(n, count / n);
  for (std::size_t i = 0; i < count % n; ++i) ++sizes[i];
  return sizes;
}

std::vector<std::size_t> split_longest_axis(std::span<PartitionItem> items, int parts) {
  const std::vector<std::size_t> sizes = split_evenly(items.size(), parts);
  select_parts(items, sizes, longest_axis(items));
  return sizes;
}

std::vector<std::size_t> split_extended_longest_axis(std::span<PartitionItem> items, int parts) {
  std::vector<std::size_t> sizes;
  halve(items, parts, sizes);
  return sizes;
}

}  // namespace rayvox
