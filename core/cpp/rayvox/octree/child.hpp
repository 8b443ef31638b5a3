#pragma once
// One slot of the octree: unknown, a uniform leaf, an inner node or a brick. Nodes and bricks are shared between the
// map and its snapshots by reference counts; whoever writes first clones what is shared (see edit.hpp), so what a
// snapshot reaches never changes.
#include <bit>
#include <cstdint>
#include <utility>

namespace rayvox {

struct InnerNode;
struct Brick;

class Child {
 public:
  enum class Kind : std::uint8_t { unknown = 0, leaf = 1, inner = 2, brick = 3 };

  Child() = default;
  static Child leaf(float log_odds) {
    return Child(std::uint64_t{std::bit_cast<std::uint32_t>(log_odds)} << 32 | tag(Kind::leaf));
  }
  /// Takes over one reference.
  static Child adopt(InnerNode* node) { return Child(reinterpret_cast<std::uintptr_t>(node) | tag(Kind::inner)); }
  static Child adopt(Brick* brick) { return Child(reinterpret_cast<std::uintptr_t>(brick) | tag(Kind::brick)); }

  Child(const Child& other) : bits_(other.bits_) { retain(); }
  Child(Child&& other) noexcept : bits_(std::exchange(other.bits_, 0)) {}
  Child& operator=(Child other) noexcept {
    std::swap(bits_, other.bits_);
    return *this;
  }
  ~Child() {
    if (kind() >= Kind::inner) release();
  }

  Kind kind() const { return static_cast<Kind>(bits_ & 3); }
  bool is_unknown() const { return bits_ == 0; }
  bool is_leaf() const { return kind() == Kind::leaf; }
  float leaf_log_odds() const { return std::bit_cast<float>(static_cast<std::uint32_t>(bits_ >> 32)); }
  InnerNode* inner() const { return reinterpret_cast<InnerNode*>(bits_ & ~std::uint64_t{3}); }
  Brick* brick() const { return reinterpret_cast<Brick*>(bits_ & ~std::uint64_t{3}); }

 private:
  explicit Child(std::uint64_t bits) : bits_(bits) {}
  static constexpr std::uint64_t tag(Kind kind) { return static_cast<std::uint64_t>(kind); }
  void retain() const;
  void release() const;

  std::uint64_t bits_ = 0;
};

}  // namespace rayvox
