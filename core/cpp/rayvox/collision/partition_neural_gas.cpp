#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "rayvox/collision/partition.hpp"

namespace rayvox {
namespace {

constexpr int iterations = 10;
constexpr std::size_t samples_per_prototype = 24;
constexpr float last_range = 0.05f;  // of the neighbourhood, in ranks

// `n` prototypes, structure of arrays, so that the loops over them become vector code.
template <int n>
class NeuralGas {
 public:
  NeuralGas(std::span<const PartitionItem> items, std::uint64_t seed) {
    std::mt19937_64 random(seed ^ items.size());
    for (int i = 0; i < n; ++i) {
      const PartitionItem& item = items[random() % items.size()];
      for (int axis = 0; axis < 3; ++axis) at_[axis][i] = item.centre[axis];
    }
  }

  // Each batch moves every prototype to the mean of the samples, weighted by exp(-rank / range): how many prototypes
  // are nearer to the sample.
  void train(std::span<const PartitionItem> items) {
    const std::size_t count = std::min(items.size(), samples_per_prototype * n);
    for (int iteration = 0; iteration < iterations; ++iteration) {
      const float progress = static_cast<float>(iteration) / (iterations - 1);
      const float range = n / 2.0f * std::pow(last_range / (n / 2.0f), progress);
      float weight_of_rank[n];
      for (int rank = 0; rank < n; ++rank) weight_of_rank[rank] = std::exp(-static_cast<float>(rank) / range);
      run_batch(items, count, weight_of_rank);
    }
  }

  int nearest(const PartitionItem& item) const {
    float squared[n];
    distances(item, squared);
    return static_cast<int>(std::min_element(squared, squared + n) - squared);
  }

 private:
  void distances(const PartitionItem& item, float* squared) const {
    for (int i = 0; i < n; ++i) {
      const float x = at_[0][i] - item.centre[0], y = at_[1][i] - item.centre[1], z = at_[2][i] - item.centre[2];
      squared[i] = x * x + y * y + z * z;
    }
  }

  void run_batch(std::span<const PartitionItem> items, std::size_t count, const float* weight_of_rank) {
    float sum[3][n] = {}, total[n] = {};
    for (std::size_t s = 0; s < count; ++s) {
      const PartitionItem& item = items[s * items.size() / count];
      float squared[n], weight[n];
      std::int32_t rank[n] = {};
      distances(item, squared);
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) rank[i] += squared[j] < squared[i] || (squared[j] == squared[i] && j < i);
      }
      for (int i = 0; i < n; ++i) weight[i] = weight_of_rank[rank[i]];
      for (int i = 0; i < n; ++i) {
        total[i] += weight[i];
        for (int axis = 0; axis < 3; ++axis) sum[axis][i] += weight[i] * item.centre[axis];
      }
    }
    for (int i = 0; i < n; ++i) {
      if (!(total[i] > 1e-20f)) continue;
      for (int axis = 0; axis < 3; ++axis) at_[axis][i] = sum[axis][i] / total[i];
    }
  }

  float at_[3][n];
};

template <int n>
std::vector<std::size_t> split(std::span<PartitionItem> items, std::uint64_t seed) {
  NeuralGas<n> gas(items, seed);
  gas.train(items);
  std::vector<std::uint8_t> cluster(items.size());
  std::array<std::size_t, n> size{}, next{};
  for (std::size_t i = 0; i < items.size(); ++i) {
    cluster[i] = static_cast<std::uint8_t>(gas.nearest(items[i]));
    ++size[cluster[i]];
  }
  for (std::size_t c = 1; c < n; ++c) next[c] = next[c - 1] + size[c - 1];
  std::vector<PartitionItem> sorted(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) sorted[next[cluster[i]]++] = items[i];
  std::copy(sorted.begin(), sorted.end(), items.begin());
  std::vector<std::size_t> sizes;
  std::copy_if(size.begin(), size.end(), std::back_inserter(sizes), [](std::size_t s) { return s > 0; });
  return sizes;
}

template <int n>
std::vector<std::size_t> split_up_to(std::span<PartitionItem> items, int parts, std::uint64_t seed) {
  if constexpr (n < 16) {
    if (parts > n) return split_up_to<n + 1>(items, parts, seed);
  }
  return split<n>(items, seed);
}

}  // namespace

std::vector<std::size_t> split_batch_neural_gas(std::span<PartitionItem> items, int parts, std::uint64_t seed) {
  return split_up_to<2>(items, parts, seed);
}

}  // namespace rayvox
