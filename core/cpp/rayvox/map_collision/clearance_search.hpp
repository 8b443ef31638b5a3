#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "rayvox/map_collision/clearance.hpp"
#include "rayvox/map_collision/placed_body.hpp"
#include "rayvox/octree/node_cursor.hpp"

namespace rayvox {

/// The search for the voxel nearest to a robot that collides with none: best first over pairs of an octree node and
/// some boxes of a link's hierarchy, by a lower bound of their distance, until no pair can be nearer than the nearest
/// triangle and voxel found (branch and bound; Hjaltason, Samet: Incremental distance join algorithms for spatial
/// databases, SIGMOD 1998). One thread's.
class ClearanceSearch {
 public:
  ClearanceSearch(const MapSnapshot& map, const ClearanceOptions& options) : map_(map), options_(options) {}

  /// `link` of the answer is the index of the body.
  PoseClearance nearest_voxel(std::span<PlacedBody> bodies);

 private:
  static constexpr std::int32_t whole_robot = -1;
  struct Box {
    Vec3d low, high;
  };
  // A node and some boxes or triangles of a body, or the box around the whole robot.
  struct Pair {
    std::int32_t body;
    BoxesOrTriangles of;
    NodeCursor node;
    Cell first;
  };
  // A pair by its position in pairs_: no triangle of it is nearer to a voxel of its node.
  struct Bound {
    float squared;
    std::uint32_t pair;
  };

  void start(std::span<PlacedBody> bodies);
  bool pop_newest(Pair& pair);
  void order_queue();
  bool pop_nearest(Pair& pair);
  void push(float squared, const Pair& pair);
  void expand(const Pair& pair);
  void expand_robot(const Pair& pair);
  void expand_body(const Pair& pair);
  void open_node(const Pair& pair, const PlacedCube& cube);
  void open_boxes(Pair pair, const PlacedCube& cube);
  void measure_triangles(const Pair& pair, const PlacedCube& cube);
  void measure_borders();
  bool counts(const NodeCursor& root) const;
  unsigned counting_children(const NodeCursor& node) const;
  float squared_gap(const Box& box, const Cell& first, int level) const;
  float body_limit(const PlacedBody& body) const;

  const MapSnapshot& map_;
  const ClearanceOptions& options_;
  std::span<PlacedBody> bodies_;
  std::vector<Box> bounds_;  // of the bodies, map frame
  Box robot_;
  std::vector<Pair> pairs_;
  std::vector<Bound> queue_;  // a heap from some point on, nearest first; before it
  std::size_t newest_ = 0;    // what is here and behind was queued last
  bool is_heap_ = false;
  float squared_limit_ = 0;  // of nearest_
  Separation nearest_;
  PoseClearance found_;
};

}  // namespace rayvox
