#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "rayvox/collision/partition.hpp"
#include "rayvox/simd/collision_kernels.hpp"

namespace rayvox {
namespace {

constexpr int iterations = 10;
constexpr std::size_t samples_per_prototype = 24;
constexpr float last_range = 0.05f;  // of the neighbourhood, in ranks

GasPrototypes start_at_items(std::span<const PartitionItem> items, int count, std::uint64_t seed) {
  GasPrototypes gas{};
  gas.count = count;
  std::mt19937_64 random(seed ^ items.size());
  for (int i = 0; i < count; ++i) {
    const PartitionItem& item = items[random() % items.size()];
    for (int axis = 0; axis < 3; ++axis) gas.at[axis][i] = item.centre[axis];
  }
  return gas;
}

// Each batch moves every prototype to the mean of the samples, weighted by exp(-rank / range): how many prototypes are
// nearer to the sample.
void train(GasPrototypes& gas, std::span<const PartitionItem> items, const CollisionKernels& kernels) {
  const std::size_t samples = std::min(items.size(), samples_per_prototype * static_cast<std::size_t>(gas.count));
  const float first_range = static_cast<float>(gas.count) / 2;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const float progress = static_cast<float>(iteration) / (iterations - 1);
    const float range = first_range * std::pow(last_range / first_range, progress);
    alignas(64) float weight_of_rank[GasPrototypes::most] = {};
    for (int rank = 0; rank < gas.count; ++rank) weight_of_rank[rank] = std::exp(-static_cast<float>(rank) / range);
    kernels.adapt_prototypes(gas, items.data(), items.size(), samples, weight_of_rank);
  }
}

std::vector<std::size_t> gather_clusters(std::span<PartitionItem> items, const std::vector<std::uint8_t>& cluster) {
  std::array<std::size_t, GasPrototypes::most> size{}, next{};
  for (const std::uint8_t c : cluster) ++size[c];
  for (std::size_t c = 1; c < size.size(); ++c) next[c] = next[c - 1] + size[c - 1];
  std::vector<PartitionItem> sorted(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) sorted[next[cluster[i]]++] = items[i];
  std::copy(sorted.begin(), sorted.end(), items.begin());
  std::vector<std::size_t> sizes;
  std::copy_if(size.begin(), size.end(), std::back_inserter(sizes), [](std::size_t s) { return s > 0; });
  return sizes;
}

}  // namespace

std::vector<std::size_t> split_batch_neural_gas(std::span<PartitionItem> items, int parts, std::uint64_t seed) {
  const CollisionKernels& kernels = collision_kernels();
  GasPrototypes gas = start_at_items(items, parts, seed);
  train(gas, items, kernels);
  std::vector<std::uint8_t> cluster(items.size());
  kernels.nearest_prototypes(gas, items.data(), items.size(), cluster.data());
  return gather_clusters(items, cluster);
}

}  // namespace rayvox
