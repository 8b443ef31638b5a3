#include "rayvox/octree/node_stream.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "rayvox/error.hpp"
#include "rayvox/octree/edit.hpp"
#include "rayvox/octree/node_cursor.hpp"

static_assert(std::endian::native == std::endian::little,
              "the map formats are little-endian and written as they lie in memory");

namespace rayvox {
namespace {

void write_node(const NodeCursor& node, std::string& out) {
  const float log_odds = node.log_odds();
  out.append(reinterpret_cast<const char*>(&log_odds), sizeof log_odds);
  const std::size_t children_at = out.size();
  out.push_back(0);
  if (node.kind() == NodeCursor::Kind::leaf) return;
  unsigned children = 0;
  for (int i = 0; i < 8; ++i) {
    const NodeCursor child = node.child(i);
    if (child.kind() == NodeCursor::Kind::unknown) continue;
    children |= 1u << i;
    write_node(child, out);
  }
  out[children_at] = static_cast<char>(children);
}

constexpr unsigned free_label = 1, occupied_label = 2, inner_label = 3;

unsigned label_of(const NodeCursor& node, const SensorModel& model) {
  if (node.kind() == NodeCursor::Kind::unknown) return 0;
  if (node.kind() == NodeCursor::Kind::inner) return inner_label;
  return model.is_occupied(node.log_odds()) ? occupied_label : free_label;
}

void write_binary_node(const NodeCursor& node, const SensorModel& model, std::string& out) {
  unsigned labels = 0;
  // The layout has no leaf at the root: a map that is one leaf is written as eight.
  for (int i = 0; i < 8; ++i) {
    const NodeCursor& child = node.kind() == NodeCursor::Kind::inner ? node.child(i) : node;
    labels |= label_of(child, model) << (2 * i);
  }
  out.push_back(static_cast<char>(labels & 0xff));
  out.push_back(static_cast<char>(labels >> 8));
  for (int i = 0; i < 8; ++i) {
    if ((labels >> (2 * i) & 3) == inner_label) write_binary_node(node.child(i), model, out);
  }
}

class Reader {
 public:
  explicit Reader(std::span<const char> bytes) : bytes_(bytes) {}

  template <class T>
  T take() {
    if (bytes_.size() - at_ < sizeof(T)) throw MapFormatError("node data is truncated at byte " + std::to_string(at_));
    T value;
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::size_t at() const { return at_; }
  void require_end() const {
    if (at_ != bytes_.size()) {
      throw MapFormatError(std::to_string(bytes_.size() - at_) + " bytes follow the last node");
    }
  }

 private:
  std::span<const char> bytes_;
  std::size_t at_ = 0;
};

[[noreturn]] void throw_too_deep(const Reader& in, int depth) {
  throw MapFormatError("a node at byte " + std::to_string(in.at()) + " lies below the octree's " +
                       std::to_string(depth) + " levels");
}

// Fills cells [first, first + 8^level) of an open brick.
void fill(OpenBrick& brick, int first, int level, float log_odds) {
  const int count = 1 << (3 * level);
  std::fill_n(brick.log_odds + first, count, log_odds);
  for (int i = first; i < first + count; ++i) brick.known[i / 64] |= std::uint64_t{1} << (i % 64);
}

// Both layouts are read by the same recursion; a Layout says what stands in the stream for a node's children.
template <class Layout>
class TreeReader {
 public:
  TreeReader(Reader& in, const Layout& layout, int depth) : in_(in), layout_(layout), depth_(depth) {}

  Child read(typename Layout::Node node, int level) {
    if (node.leaf) return Child::leaf(node.log_odds);
    if (level == brick_level) {
      OpenBrick brick;
      read_into(brick, node, level, 0);
      return brick.close();
    }
    Child slot;
    InnerNode& inner = open_inner(slot, 0);
    layout_.for_each_child(in_, node,
                           [&](int i, typename Layout::Node child) { inner.child[i] = read(child, level - 1); });
    close_inner(slot);
    return slot;
  }

 private:
  void read_into(OpenBrick& brick, typename Layout::Node node, int level, int first) {
    if (node.leaf) return fill(brick, first, level, node.log_odds);
    if (level == 0) throw_too_deep(in_, depth_);
    layout_.for_each_child(in_, node, [&](int i, typename Layout::Node child) {
      read_into(brick, child, level - 1, first + (i << (3 * (level - 1))));
    });
  }

  Reader& in_;
  const Layout& layout_;
  int depth_;
};

struct Node {
  bool leaf;
  float log_odds;     // of a leaf
  unsigned children;  // of an inner node, in the layout's own coding
};

struct FullLayout {
  using Node = rayvox::Node;

  Node take(Reader& in) const {
    const float log_odds = in.take<float>();
    if (!std::isfinite(log_odds))
      throw MapFormatError("log-odds before byte " + std::to_string(in.at()) + " are not finite");
    const unsigned children = in.take<std::uint8_t>();
    return {children == 0, log_odds, children};
  }
  template <class Visit>
  void for_each_child(Reader& in, const Node& node, const Visit& visit) const {
    for (int i = 0; i < 8; ++i) {
      if (node.children >> i & 1) visit(i, take(in));
    }
  }
};

struct BinaryLayout {
  using Node = rayvox::Node;
  const SensorModel& model;

  Node take(Reader& in) const { return {false, 0, in.take<std::uint16_t>()}; }
  template <class Visit>
  void for_each_child(Reader& in, const Node& node, const Visit& visit) const {
    for (int i = 0; i < 8; ++i) {
      const unsigned label = node.children >> (2 * i) & 3;
      if (label == free_label) visit(i, Node{true, model.clamp_min_log_odds, 0});
      if (label == occupied_label) visit(i, Node{true, model.clamp_max_log_odds, 0});
      if (label == inner_label) visit(i, take(in));
    }
  }
};

template <class Layout>
Child read_tree(std::span<const char> bytes, int depth, const Layout& layout) {
  if (bytes.empty()) return Child();
  Reader in(bytes);
  const Node root = layout.take(in);
  Child slot = TreeReader<Layout>(in, layout, depth).read(root, depth);
  in.require_end();
  return slot;
}

}  // namespace

std::string write_nodes(const MapSnapshot& map) {
  std::string out;
  if (!map.root.is_unknown()) write_node(NodeCursor(map.root, map.geometry.depth()), out);
  return out;
}

std::string write_binary_nodes(const MapSnapshot& map) {
  std::string out;
  if (!map.root.is_unknown()) write_binary_node(NodeCursor(map.root, map.geometry.depth()), map.model, out);
  return out;
}

Child read_nodes(std::span<const char> bytes, int depth) { return read_tree(bytes, depth, FullLayout{}); }

Child read_binary_nodes(std::span<const char> bytes, int depth, const SensorModel& model) {
  return read_tree(bytes, depth, BinaryLayout{model});
}

}  // namespace rayvox
