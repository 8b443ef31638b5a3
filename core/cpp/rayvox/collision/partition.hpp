#pragma once
// Splitting criteria (SIMDop, Sec. IV-A): a set of triangles, each represented by its centre, into up to n parts.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rayvox/collision/neural_gas.hpp"

namespace rayvox {

/// A triangle's box, for the surface area heuristic.
struct TriangleBounds {
  float low[3], high[3];
};

/// Each reorders `items` so that the parts are consecutive, and returns their sizes: at most `parts` of them, none
/// empty, at least two unless all centres are equal to each other. `items` has at least two elements.
/// The sorted list along the longest axis of the centres' box, in equal numbers (Sec. IV-A.1).
std::vector<std::size_t> split_longest_axis(std::span<PartitionItem> items, int parts);
/// Halves along the longest axis, each half again along its own, until there are `parts` (Sec. IV-A.2).
std::vector<std::size_t> split_extended_longest_axis(std::span<PartitionItem> items, int parts);
/// Batch Neural Gas clusters (Sec. IV-A.3; Weller et al., "Massively Parallel Batch Neural Gas for Bounding Volume
/// Hierarchy Construction", 2014). Deterministic for a seed.
std::vector<std::size_t> split_batch_neural_gas(std::span<PartitionItem> items, int parts, std::uint64_t seed);
/// The plane among 3 x 32 with the least sum of surface area times number of triangles, in two parts.
std::vector<std::size_t> split_surface_area(std::span<PartitionItem> items, std::span<const TriangleBounds> bounds);

/// In equal numbers, in the order they are in: what is left where centres coincide.
std::vector<std::size_t> split_evenly(std::size_t count, int parts);

}  // namespace rayvox
