#pragma once
// What the kernels of Batch Neural Gas (neural_gas.inc.hpp) read and write.
#include <cstdint>

namespace rayvox {

/// A triangle by its centre, relative to the mesh's.
struct PartitionItem {
  float centre[3];
  std::uint32_t triangle;
};

struct alignas(64) GasPrototypes {
  static constexpr int most = 16;
  float at[3][most];
  int count;
};

}  // namespace rayvox
