#include "rayvox/octree/node_stream.hpp"

#include "brute_force.hpp"
#include "check.hpp"
#include "rayvox/error.hpp"
#include "rayvox/occupancy_map.hpp"
#include "rayvox/octree/octomap_file.hpp"

using namespace rayvox;

namespace {

MapSnapshot random_map(int depth = 16) {
  std::mt19937_64 random(13);
  OccupancyMap map(MapGeometry(0.1, depth), SensorModel());
  for (int scan = 0; scan < 5; ++scan) {
    const brute_force::RandomScan drawn(random, 100, 30);
    for (int pass = 0; pass < 4; ++pass) map.insert(brute_force::scan_of(drawn.rays, drawn.marks_end));
  }
  return map.snapshot();
}

}  // namespace

FACT(nodes_round_trip_at_every_depth) {
  for (const int depth : {7, 16, 21}) {
    const MapSnapshot map = random_map(depth);
    const std::string nodes = write_nodes(map);
    MapSnapshot back = map;
    back.root = read_nodes(nodes, depth);
    CHECK(write_nodes(back) == nodes);
    CHECK(brute_force::cells_of(back) == brute_force::cells_of(map));
  }
}

FACT(files_round_trip_byte_for_byte) {
  const MapSnapshot map = random_map();
  const std::string ot = to_ot(map), bt = to_bt(map);
  CHECK(to_ot(read_octomap(ot, SensorModel())) == ot);
  CHECK(to_bt(read_octomap(bt, SensorModel())) == bt);
}

FACT(an_empty_map_round_trips) {
  const MapSnapshot empty{MapGeometry(0.1, 16), SensorModel(), {}, 0, 0, 0};
  CHECK(read_octomap(to_ot(empty), SensorModel()).root.is_unknown());
  CHECK(read_octomap(to_bt(empty), SensorModel()).root.is_unknown());
}

FACT(every_truncation_is_refused) {
  const std::string nodes = write_nodes(random_map());
  for (std::size_t length = 1; length < nodes.size(); length += 1 + nodes.size() / 500) {
    CHECK_THROWS(MapFormatError, read_nodes({nodes.data(), length}, 16));
  }
  const std::string longer = nodes + "x";
  CHECK_THROWS(MapFormatError, read_nodes(longer, 16));
}

FACT(random_damage_is_read_or_refused_but_never_more) {
  const std::string good = to_bt(random_map());
  std::mt19937_64 random(14);
  for (int sample = 0; sample < 2000; ++sample) {
    std::string bad = good;
    for (int i = 0; i < 3; ++i) bad[random() % bad.size()] = static_cast<char>(random());
    try {
      CHECK(write_nodes(read_octomap(bad, SensorModel())).size() <= 40 * bad.size());
    } catch (const Error&) {
    }
  }
}

FACT(a_chain_deeper_than_the_octree_is_refused) {
  // Every node has child 0: 17 inner nodes below each other.
  std::string nodes;
  for (int i = 0; i < 18; ++i) nodes += std::string(4, '\0') + '\1';
  CHECK_THROWS(MapFormatError, read_nodes(nodes, 16));
}

FACT(log_odds_that_are_not_finite_are_refused) {
  const std::string nan{"\0\0\xc0\x7f\0", 5};
  CHECK_THROWS(MapFormatError, read_nodes(nan, 16));
}

FACT(headers_that_lie_are_refused_by_name) {
  const std::string good = to_ot(random_map());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  CHECK_THROWS(MapFormatError, read_octomap(with("# Octomap", "# Octopus"), SensorModel()));
  CHECK_THROWS(MapFormatError, read_octomap(with("id OcTree", "id ColorOcTree"), SensorModel()));
  CHECK_THROWS(MapFormatError, read_octomap(with("res 0.1", "res -1"), SensorModel()));
  CHECK_THROWS(MapFormatError, read_octomap(with("res 0.1", "res x"), SensorModel()));
  CHECK_THROWS(MapFormatError, read_octomap(with("data\n", "date\n"), SensorModel()));
  CHECK_THROWS(MapFormatError, read_octomap(std::string(), SensorModel()));
}

FACT(only_sixteen_levels_fit_octomaps_files) { CHECK_THROWS(InvalidInput, to_bt(random_map(12))); }
