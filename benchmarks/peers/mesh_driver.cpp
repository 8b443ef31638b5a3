// Times boolean queries of Coal (-DWITH_COAL) or FCL, without any binding between: of two meshes, or of a mesh with the
// occupied voxels of a map. Builds the hierarchies from the mesh files, then asks at every pose of the second mesh, or of
// the one, and writes one byte a pose and the seconds as JSON to standard output.
//
//   mesh_driver MESH POSES VERDICTS REPEATS [SECOND_MESH | MAP.bt]
//
// MESH: int64 vertices, int64 triangles, float64 coordinates, int32 indices. POSES: int64 count, row-major 4x4 float64.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <octomap/OcTree.h>

#ifdef WITH_COAL
#include <coal/BVH/BVH_model.h>
#include <coal/collision.h>
#include <coal/collision_data.h>
#include <coal/octree.h>
namespace peer = coal;
using Vector = coal::Vec3s;
using Transform = coal::Transform3s;
#else
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/narrowphase/collision.h>
namespace peer = fcl;
using Vector = fcl::Vector3d;
using Transform = fcl::Transform3d;
#endif

namespace {

template <class T>
std::vector<T> read(std::ifstream& in, std::size_t count) {
  std::vector<T> values(count);
  in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
  return values;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Mesh {
  std::vector<double> vertices;
  std::vector<std::int32_t> triangles;

  explicit Mesh(const char* path) {
    std::ifstream in(path, std::ios::binary);
    const auto counts = read<std::int64_t>(in, 2);
    vertices = read<double>(in, static_cast<std::size_t>(3 * counts[0]));
    triangles = read<std::int32_t>(in, static_cast<std::size_t>(3 * counts[1]));
  }
};

#ifdef WITH_COAL
template <class Volume>
using Model = coal::BVHModel<Volume>;
using Obb = coal::OBB;
using ObbRss = coal::OBBRSS;
using OcTree = coal::OcTree;
using OctomapPointer = coal::shared_ptr<const octomap::OcTree>;
#else
template <class Volume>
using Model = fcl::BVHModel<Volume>;
using Obb = fcl::OBBd;
using ObbRss = fcl::OBBRSSd;
using OcTree = fcl::OcTreed;
using OctomapPointer = std::shared_ptr<const octomap::OcTree>;
#endif

template <class Volume>
std::shared_ptr<Model<Volume>> build(const Mesh& mesh) {
  std::vector<Vector> points;
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) {
    points.emplace_back(mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]);
  }
  std::vector<peer::Triangle> triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    triangles.emplace_back(static_cast<std::size_t>(mesh.triangles[i]), static_cast<std::size_t>(mesh.triangles[i + 1]),
                           static_cast<std::size_t>(mesh.triangles[i + 2]));
  }
  auto model = std::make_shared<Model<Volume>>();
  model->beginModel();
  model->addSubModel(points, triangles);
  model->endModel();
  return model;
}

std::vector<Transform> read_poses(const char* path) {
  std::ifstream in(path, std::ios::binary);
  const auto count = read<std::int64_t>(in, 1);
  const auto values = read<double>(in, static_cast<std::size_t>(16 * count[0]));
  std::vector<Transform> poses;
  for (std::size_t i = 0; i < values.size(); i += 16) {
    Eigen::Matrix3d rotation;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) rotation(r, c) = values[i + static_cast<std::size_t>(4 * r + c)];
    }
    const Vector translation(values[i + 3], values[i + 7], values[i + 11]);
#ifdef WITH_COAL
    poses.emplace_back(rotation, translation);
#else
    Transform pose = Transform::Identity();
    pose.linear() = rotation;
    pose.translation() = translation;
    poses.push_back(pose);
#endif
  }
  return poses;
}

template <class Fixed>
bool collide(const Fixed& fixed, const Model<Obb>& moved, const Transform& pose) {
#ifdef WITH_COAL
  coal::CollisionRequest request(coal::CONTACT, 1);
  request.enable_contact = false;
  request.break_distance = 0;
  request.security_margin = 0;
  coal::CollisionResult result;
  return coal::collide(&moved, pose, &fixed, Transform::Identity(), request, result) > 0;
#else
  fcl::CollisionRequestd request(1, false);
  fcl::CollisionResultd result;
  return fcl::collide<double>(&moved, pose, &fixed, Transform::Identity(), request, result) > 0;
#endif
}

// Fills in the verdicts; microseconds a query of each repeat, separated by commas.
template <class Fixed>
std::string timed_queries(const Fixed& fixed, const Model<Obb>& moved, const std::vector<Transform>& poses, int repeats,
                          std::vector<char>& verdicts) {
  std::string passes;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < poses.size(); ++i) verdicts[i] = collide(fixed, moved, poses[i]);
    passes +=
        (passes.empty() ? "" : ", ") + std::to_string(1e6 * seconds_since(start) / static_cast<double>(poses.size()));
  }
  return passes;
}

OcTree read_map(const char* path) {
  const auto tree = std::make_shared<octomap::OcTree>(0.1);
  if (!tree->readBinary(path)) std::exit(2);
  OcTree map{OctomapPointer(tree)};
  map.computeLocalAABB();
  return map;
}

}  // namespace

int main(int count, char** arguments) {
  const Mesh mesh(arguments[1]);
  const std::vector<Transform> poses = read_poses(arguments[2]);
  const auto start_rss = std::chrono::steady_clock::now();
  const auto unused = build<ObbRss>(mesh);
  const double build_obbrss = seconds_since(start_rss);
  const auto start_obb = std::chrono::steady_clock::now();
  const auto first = build<Obb>(mesh);
  const double build_obb = seconds_since(start_obb);
  std::vector<char> verdicts(poses.size());
  const int repeats = std::atoi(arguments[4]);
  const std::string other = count > 5 ? arguments[5] : arguments[1];
  const bool is_map = other.size() > 3 && other.compare(other.size() - 3, 3, ".bt") == 0;
  const std::string passes =
      is_map ? timed_queries(read_map(other.c_str()), *first, poses, repeats, verdicts)
             : timed_queries(*first, *build<Obb>(Mesh(other.c_str())), poses, repeats, verdicts);
  std::ofstream(arguments[3], std::ios::binary).write(verdicts.data(), static_cast<std::streamsize>(verdicts.size()));
  std::printf("{\"build_obbrss_s\": %.6f, \"build_obb_s\": %.6f, \"query_us\": [%s]}\n", build_obbrss, build_obb,
              passes.c_str());
  std::fflush(stdout);
  std::_Exit(0);  // FCL's and OctoMap's libraries, as packaged, free each other's statics at exit
}
