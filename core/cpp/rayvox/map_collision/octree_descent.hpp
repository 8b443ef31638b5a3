#pragma once
#include <cstdint>
#include <vector>

#include "rayvox/map_collision/check_poses.hpp"
#include "rayvox/map_collision/placed_body.hpp"
#include "rayvox/octree/node_cursor.hpp"

namespace rayvox {

/// The simultaneous traversal of a link's hierarchy and an octree: down the octree, where it holds what counts, with a
/// front of the hierarchy's boxes that meet the node. One thread's.
class OctreeDescent {
 public:
  OctreeDescent(const MapSnapshot& map, const MapCheckOptions& options) : map_(map), options_(options) {}

  void start_pose(std::uint32_t pose);
  /// Adds what the placed body meets; true if nothing more can change the pose's answer.
  bool check_link(PlacedBody& body, std::uint32_t link);
  MapVerdict verdict() const {
    return occupied_ ? MapVerdict::occupied : unknown_ ? MapVerdict::unknown : MapVerdict::free;
  }
  std::vector<VoxelContact>& contacts() { return contacts_; }

 private:
  // Boxes that still count: some lanes of a block.
  struct Entry {
    std::uint32_t block, lanes;
  };
  // A range of `front_`.
  struct Front {
    std::size_t begin, end;
  };
  // What of a node counts for the answer.
  struct Relevance {
    bool occupied, unknown;
    explicit operator bool() const { return occupied || unknown; }
  };
  struct Untouched {
    NodeCursor node;
    Cell first;
  };

  Relevance relevance(const NodeCursor& node) const;
  void descend(const NodeCursor& node, const Cell& first, Front front);
  void descend_children(const NodeCursor& node, const Cell& first, Front front);
  Front narrow(Front front, const PlacedCube& cube);
  bool surface_meets(Front front, const PlacedCube& cube);
  void leave_untouched(const NodeCursor& node, const Cell& first);
  void check_enclosed();
  void report_all(const NodeCursor& node, const Cell& first);
  void report(const NodeCursor& leaf, const Cell& first);
  bool done() const { return occupied_ && options_.contacts != Contacts::all; }

  const MapSnapshot& map_;
  const MapCheckOptions& options_;
  PlacedBody* body_ = nullptr;
  CellBox reach_{};
  std::uint32_t pose_ = 0, link_ = 0;
  std::size_t first_contact_ = 0;
  bool occupied_ = false, unknown_ = false;
  std::vector<Entry> front_;
  std::vector<Untouched> untouched_;
  std::vector<VoxelContact> contacts_;
};

}  // namespace rayvox
