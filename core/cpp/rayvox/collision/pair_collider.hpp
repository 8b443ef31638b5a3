#pragma once
#include <cstdint>
#include <vector>

#include "rayvox/collision/collide.hpp"
#include "rayvox/collision/relative_placement.hpp"
#include "rayvox/collision/solid.hpp"

namespace rayvox {

/// The query between two meshes at one pose after the other, and its answers to the kernels' questions. One thread's.
class PairCollider {
 public:
  PairCollider(const PairTables& tables, const Solid& solid_a, const Solid& solid_b, const CollideOptions& options);
  PairCollider(const PairCollider&) = delete;

  /// CollideResult's state. Adds contacts, if asked for, under this index of the pose.
  std::uint8_t collide(std::uint32_t pose_index, const RigidTransform& T_a_b);
  /// Of the last query.
  const TraversalCounts& counts() const { return counts_; }
  std::vector<Contact>& contacts() { return contacts_; }

 private:
  bool touch(std::uint32_t a, std::uint32_t b) const;
  bool contact(std::uint32_t a, std::uint32_t b);
  bool one_contains_the_other() const;

  const PairTables& tables_;
  const Solid &solid_a_, &solid_b_;
  const CollideOptions& options_;
  std::vector<std::uint64_t> stack_;
  TraversalQuery query_;
  RelativePose pose_;
  Placement placement_;
  TraversalCounts counts_;
  std::vector<Contact> contacts_;
  std::uint32_t pose_index_ = 0;
  bool found_ = false;
};

}  // namespace rayvox
