// OctoMap's own C++ library on the benchmark's scans: insertion, ray shooting alone, memory, leaves.
//
//   octomap_driver time|memory SCANS RESOLUTION_M MAX_RANGE_M PASSES [LEAVES_OUT]
//
// "time" inserts each scan into an empty tree, then all scans PASSES times into one; "memory" does only the latter.
// SCANS: "RVSC", u32 number of scans, then per scan u32 n, f32 origin[3], f32 points[n][3] (map frame, little-endian).
// MAX_RANGE_M < 0: unlimited. Prints one JSON object. LEAVES_OUT: i32 key[3], u32 depth, f32 log-odds per leaf, 20 bytes each,
// key 0 at the map's origin, of the tree after one pass over all scans.
#include <octomap/octomap.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

struct Scan {
  octomap::point3d origin;
  octomap::Pointcloud points;
};

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

template <typename T>
T read_value(std::istream& in) {
  T value;
  in.read(reinterpret_cast<char*>(&value), sizeof value);
  if (!in) throw std::runtime_error("the scan file ends early");
  return value;
}

std::vector<Scan> read_scans(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || read_value<std::uint32_t>(in) != 0x43535652u) throw std::runtime_error("not a scan file: " + path);
  std::vector<Scan> scans(read_value<std::uint32_t>(in));
  for (Scan& scan : scans) {
    const auto count = read_value<std::uint32_t>(in);
    float xyz[3];
    in.read(reinterpret_cast<char*>(xyz), sizeof xyz);
    scan.origin = octomap::point3d(xyz[0], xyz[1], xyz[2]);
    scan.points.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      in.read(reinterpret_cast<char*>(xyz), sizeof xyz);
      scan.points.push_back(xyz[0], xyz[1], xyz[2]);
    }
    if (!in) throw std::runtime_error("the scan file ends early");
  }
  return scans;
}

std::size_t status_bytes(const char* field) {
  std::ifstream in("/proc/self/status");
  std::string word;
  while (in >> word)
    if (word == field) {
      std::size_t kib = 0;
      in >> kib;
      return kib * 1024;
    }
  return 0;
}

double time_insertion(octomap::OcTree& tree, const Scan& scan, double max_range_m) {
  const double start = seconds_now();
  tree.insertPointCloud(scan.points, scan.origin, max_range_m);
  return seconds_now() - start;
}

// Voxel keys of every ray, one after the other, no set, no tree: the DDA alone.
double time_ray_keys(const octomap::OcTree& tree, const Scan& scan, std::size_t& steps) {
  octomap::KeyRay ray;
  const double start = seconds_now();
  for (const octomap::point3d& end : scan.points) {
    tree.computeRayKeys(scan.origin, end, ray);
    steps += ray.size();
  }
  return seconds_now() - start;
}

// Free and occupied key sets of the scan: what OctoMap does before it touches the tree.
double time_key_sets(octomap::OcTree& tree, const Scan& scan, double max_range_m) {
  octomap::KeySet free_cells, occupied_cells;
  const double start = seconds_now();
  tree.computeUpdate(scan.points, scan.origin, free_cells, occupied_cells, max_range_m);
  return seconds_now() - start;
}

void print_list(const char* name, const std::vector<double>& values) {
  std::printf("\"%s\": [", name);
  for (std::size_t i = 0; i < values.size(); ++i) std::printf(i ? ", %.6f" : "%.6f", values[i]);
  std::printf("], ");
}

void dump_leaves(const octomap::OcTree& tree, const std::string& path) {
  std::ofstream out(path, std::ios::binary);
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const octomap::OcTreeKey key = leaf.getIndexKey();
    const std::uint32_t depth = leaf.getDepth();
    const float log_odds = leaf->getLogOdds();
    for (int axis = 0; axis < 3; ++axis) {
      const std::int32_t cell = static_cast<std::int32_t>(key[axis]) - 32768;
      out.write(reinterpret_cast<const char*>(&cell), sizeof cell);
    }
    out.write(reinterpret_cast<const char*>(&depth), sizeof depth);
    out.write(reinterpret_cast<const char*>(&log_odds), sizeof log_odds);
  }
  if (!out.flush()) throw std::runtime_error("cannot write " + path);
}

void print_first_scans(const std::vector<Scan>& scans, double resolution_m, double max_range_m) {
  std::vector<double> first, rays, sets;
  std::size_t steps = 0;
  for (const Scan& scan : scans) {
    octomap::OcTree tree(resolution_m);
    rays.push_back(time_ray_keys(tree, scan, steps));
    sets.push_back(time_key_sets(tree, scan, max_range_m));
    first.push_back(time_insertion(tree, scan, max_range_m));
  }
  print_list("first_s", first);
  print_list("ray_keys_s", rays);
  print_list("key_sets_s", sets);
  std::printf("\"ray_steps\": %zu, ", steps);
}

void print_passes(const std::vector<Scan>& scans, double resolution_m, double max_range_m, int passes,
                  const std::string& leaves_path) {
  std::vector<double> seconds;
  const std::size_t resident_before = status_bytes("VmRSS:");
  octomap::OcTree tree(resolution_m);
  std::size_t leaves = 0, bytes = 0;
  for (int pass = 0; pass < passes; ++pass) {
    for (const Scan& scan : scans) seconds.push_back(time_insertion(tree, scan, max_range_m));
    if (pass > 0) continue;
    leaves = tree.getNumLeafNodes();
    bytes = tree.memoryUsage();
    if (!leaves_path.empty()) dump_leaves(tree, leaves_path);
  }
  print_list("pass_s", seconds);
  const std::size_t resident = status_bytes("VmRSS:");
  std::printf("\"scans\": %zu, \"passes\": %d, \"leaves\": %zu, \"map_bytes\": %zu, ", scans.size(), passes, leaves, bytes);
  std::printf("\"final_leaves\": %zu, \"final_map_bytes\": %zu, ", tree.getNumLeafNodes(), tree.memoryUsage());
  std::printf("\"resident_before_bytes\": %zu, \"resident_bytes\": %zu, ", resident_before, resident);
  std::printf("\"peak_resident_bytes\": %zu", status_bytes("VmHWM:"));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (argc < 6 || (mode != "time" && mode != "memory")) {
    std::fprintf(stderr, "usage: octomap_driver time|memory SCANS RESOLUTION_M MAX_RANGE_M PASSES [LEAVES_OUT]\n");
    return 2;
  }
  try {
    const std::vector<Scan> scans = read_scans(argv[2]);
    const double resolution_m = std::atof(argv[3]), max_range_m = std::atof(argv[4]);
    std::printf("{");
    if (mode == "time") print_first_scans(scans, resolution_m, max_range_m);
    print_passes(scans, resolution_m, max_range_m, std::atoi(argv[5]), argc > 6 ? argv[6] : "");
    std::printf("}\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "octomap_driver: %s\n", error.what());
    return 1;
  }
  return 0;
}
