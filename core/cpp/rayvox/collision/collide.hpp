#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rayvox/collision/kdop_bvh.hpp"
#include "rayvox/simd/collision_kernels.hpp"

namespace rayvox {

enum class Contacts { none, first, all };

/// Two triangles, by their index in their meshes, that touch or cross at a pose.
struct Contact {
  std::uint32_t pose, triangle_a, triangle_b;
  bool operator==(const Contact&) const = default;
};

struct CollideOptions {
  Contacts contacts = Contacts::none;
  bool solids = true;  // a component wholly inside a closed component of the other mesh collides
  bool statistics = false;
  const CollisionKernels* kernels = nullptr;  // null: the best this processor runs
};

struct CollideResult {
  enum : std::uint8_t { apart = 0, surfaces_touch = 1, contained = 2 };
  std::vector<std::uint8_t> state;          // per pose
  std::vector<Contact> contacts;            // by pose; all: also by triangles
  std::vector<TraversalCounts> statistics;  // per pose, if asked for
};

/// Whether b, placed by each pose (T_a_b, row-major 4x4), collides with a. Touching counts. All threads.
/// Throws InvalidInput for a pose that is not rigid, naming its index, and for hierarchies built differently.
CollideResult collide(const KdopBvh& a, const KdopBvh& b, std::span<const double> poses, const CollideOptions& options);

}  // namespace rayvox
