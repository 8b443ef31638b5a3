// OctoMap's own castRay on a batch of rays, unknown space passed.
//
//   octomap_ray_driver MAP.ot RAYS MAX_RANGE_M HITS_OUT
//
// RAYS: f32 origin[3], direction[3] per ray, little-endian. HITS_OUT: u32 hit, f32 centre[3] of the voxel per ray. Prints the
// processor seconds that all rays took.
#include <octomap/octomap.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <memory>
#include <vector>

namespace {

struct Ray {
  float origin[3], direction[3];
};
struct Hit {
  std::uint32_t hit;
  float centre[3];
};

std::vector<Ray> read_rays(const char* path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  std::vector<Ray> rays(static_cast<std::size_t>(in.tellg()) / sizeof(Ray));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(rays.data()), static_cast<std::streamsize>(rays.size() * sizeof(Ray)));
  return rays;
}

Hit cast(const octomap::OcTree& tree, const Ray& ray, double max_range_m) {
  const octomap::point3d origin(ray.origin[0], ray.origin[1], ray.origin[2]);
  const octomap::point3d direction(ray.direction[0], ray.direction[1], ray.direction[2]);
  octomap::point3d end;
  const bool hit = tree.castRay(origin, direction, end, true, max_range_m);
  return {hit, {end.x(), end.y(), end.z()}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: octomap_ray_driver MAP.ot RAYS MAX_RANGE_M HITS_OUT\n");
    return 2;
  }
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(argv[1]));
  const auto* tree = dynamic_cast<const octomap::OcTree*>(read.get());
  if (!tree) {
    std::fprintf(stderr, "octomap_ray_driver: cannot read %s\n", argv[1]);
    return 1;
  }
  const std::vector<Ray> rays = read_rays(argv[2]);
  const double max_range_m = std::atof(argv[3]);
  std::vector<Hit> hits;
  hits.reserve(rays.size());
  const std::clock_t start = std::clock();
  for (const Ray& ray : rays) hits.push_back(cast(*tree, ray, max_range_m));
  std::printf("%.6f\n", static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  std::ofstream out(argv[4], std::ios::binary);
  out.write(reinterpret_cast<const char*>(hits.data()), static_cast<std::streamsize>(hits.size() * sizeof(Hit)));
  return out.flush() ? 0 : 1;
}
