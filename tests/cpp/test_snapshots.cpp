#include <algorithm>

#include "brute_force.hpp"
#include "check.hpp"
#include "rayvox/error.hpp"
#include "rayvox/occupancy_map.hpp"
#include "rayvox/octree/change_set.hpp"
#include "rayvox/octree/node_stream.hpp"

using namespace rayvox;

namespace {

// Applies a change set to a copy of the cells.
void apply(const MapSnapshot& map, std::uint64_t since, std::map<Cell, float>& copy) {
  const ChangedRegions changes = changed_regions(map, since);
  if (changes.full) copy.clear();
  for (const Region& region : changes.regions) {
    const int size = 1 << region.level;
    std::erase_if(copy, [&](const auto& entry) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (entry.first[i] < region.first[i] || entry.first[i] >= region.first[i] + size) return false;
      }
      return true;
    });
  }
  const LeafReadout readout(map, changes.regions);
  std::vector<std::int64_t> keys(3 * readout.count());
  std::vector<std::uint8_t> depth(readout.count());
  std::vector<float> log_odds(readout.count());
  readout.write({keys.data(), depth.data(), log_odds.data()});
  for (std::size_t i = 0; i < readout.count(); ++i) {
    const int size = 1 << (map.geometry.depth() - depth[i]);
    for (int c = 0; c < size * size * size; ++c) {
      copy[{static_cast<int>(keys[3 * i]) + c % size, static_cast<int>(keys[3 * i + 1]) + c / size % size,
            static_cast<int>(keys[3 * i + 2]) + c / size / size}] = log_odds[i];
    }
  }
}

}  // namespace

FACT(a_snapshot_never_changes_while_the_map_goes_on) {
  std::mt19937_64 random(9);
  OccupancyMap map(MapGeometry(1.0, 16), SensorModel());
  std::vector<MapSnapshot> snapshots;
  std::vector<std::string> bytes;
  for (int scan = 0; scan < 15; ++scan) {
    const brute_force::RandomScan drawn(random, 80, 14);
    map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
    if (scan % 4 == 3) map.clear_box({-3, -3, -3}, {2.5, 2.5, 2.5});
    snapshots.push_back(map.snapshot());
    bytes.push_back(write_nodes(snapshots.back()));
  }
  for (std::size_t i = 0; i < snapshots.size(); ++i) CHECK(write_nodes(snapshots[i]) == bytes[i]);
}

FACT(change_sets_carry_a_copy_from_any_revision_to_any_later_one) {
  std::mt19937_64 random(10);
  OccupancyMap map(MapGeometry(1.0, 16), SensorModel());
  std::vector<MapSnapshot> history{map.snapshot()};
  for (int edit = 0; edit < 12; ++edit) {
    if (edit % 5 == 4) {
      map.clear_box({-2.0, -5.0, -20.0}, {7.5, 30.0, 3.0});
    } else {
      const brute_force::RandomScan drawn(random, 40, 25);
      for (int pass = 0; pass < 1 + edit % 3 * 6; ++pass) map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
    }
    history.push_back(map.snapshot());
  }
  for (std::size_t from = 0; from < history.size(); ++from) {
    std::map<Cell, float> copy = brute_force::cells_of(history[from]);
    apply(history.back(), history[from].revision, copy);
    CHECK(copy == brute_force::cells_of(history.back()));
  }
  CHECK(changed_regions(history.back(), history.back().revision).regions.empty());
}

FACT(a_loaded_map_answers_older_revisions_with_everything) {
  std::mt19937_64 random(11);
  OccupancyMap map(MapGeometry(1.0, 16), SensorModel());
  const brute_force::RandomScan drawn(random, 40, 10);
  map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
  const std::string nodes = write_nodes(map.snapshot());
  const MapSnapshot loaded{MapGeometry(1.0, 16), SensorModel(), read_nodes(nodes, 16), 7, 7, 7};
  CHECK(changed_regions(loaded, 3).full);
  CHECK(!changed_regions(loaded, 7).full);
  CHECK(changed_regions(loaded, 8).full);
  std::map<Cell, float> stale{{{1000, 1000, 1000}, 1.0f}};
  apply(loaded, 3, stale);
  CHECK(stale == brute_force::cells_of(loaded));
}

FACT(clearing_a_box_makes_exactly_its_cells_unknown) {
  std::mt19937_64 random(12);
  OccupancyMap map(MapGeometry(0.5, 16), SensorModel());
  brute_force::CellMap expected{SensorModel()};
  const brute_force::RandomScan drawn(random, 200, 20);
  map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
  expected.insert(drawn.rays, drawn.marks_end);
  map.clear_box({-2.5, -1.25, 0.0}, {3.0, 4.9, 2.0});
  expected.clear({-5, -3, 0}, {6, 9, 4});
  CHECK(brute_force::cells_of(map.snapshot()) == expected.cells);
  map.clear_box({-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9});
  CHECK(map.snapshot().root.is_unknown());
  CHECK_THROWS(InvalidInput, map.clear_box({1, 0, 0}, {0, 1, 1}));
  CHECK_THROWS(InvalidInput, map.clear_box({NAN, 0, 0}, {0, 1, 1}));
}
