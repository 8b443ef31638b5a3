#pragma once
// The part of Embree 4's C interface that rayvox calls, declared here so that building needs no Embree headers.
// Layouts, alignments and numbers are those of embree4/rtcore_*.h (4.0 to 4.4); version and features are checked at run
// time (embree_library.cpp).
#include <sys/types.h>

#include <cstdint>

namespace rayvox::embree {

struct DeviceHandle;
struct SceneHandle;
struct GeometryHandle;

enum DeviceProperty : int { version_major = 1, version_number = 0, user_geometry_supported = 100 };
enum GeometryType : int { user_geometry = 120 };
enum BuildQuality : int { quality_low = 0, quality_medium = 1 };
enum SceneFlags : int { flag_none = 0, flag_dynamic = 1 << 0, flag_robust = 1 << 2 };
enum QueryFlags : int { query_incoherent = 0, query_coherent = 1 << 16 };
constexpr std::uint32_t all_features = 0xffffffff;
constexpr std::uint32_t invalid_id = 0xffffffff;

struct alignas(16) Bounds {
  float lower_x, lower_y, lower_z, align0;
  float upper_x, upper_y, upper_z, align1;
};
static_assert(sizeof(Bounds) == 32);

/// Sixteen rays, each field an array: what a query takes, and what callbacks see with N for 16 (a query may be
/// answered in smaller packets; `id` tells which ray is which).
struct alignas(64) Ray16 {
  float origin[3][16], t_near[16], direction[3][16], time[16], t_far[16];
  std::uint32_t mask[16], id[16], flags[16];
};
constexpr std::uint32_t id_row = 10;  // fields before `id`

/// Embree hands the address given with a query through to the callbacks, so a caller's own data may follow. Its own
/// part is 4 to 16 bytes, as the library was configured.
struct QueryContext {
  std::uint32_t instance_ids[4] = {invalid_id, invalid_id, invalid_id, invalid_id};
};

struct OccludedArguments;
struct OccludedFunctionArguments {
  int* valid;
  void* geometry_data;
  std::uint32_t primitive;
  QueryContext* context;
  void* rays;  // a packet of N
  std::uint32_t N;
  std::uint32_t geometry;
};
using OccludedFunction = void (*)(const OccludedFunctionArguments*);

struct BoundsFunctionArguments {
  void* geometry_data;
  std::uint32_t primitive;
  std::uint32_t time_step;
  Bounds* bounds;
};
using BoundsFunction = void (*)(const BoundsFunctionArguments*);

struct OccludedArguments {
  int flags = query_incoherent;
  std::uint32_t features = all_features;
  QueryContext* context = nullptr;
  void* filter = nullptr;
  OccludedFunction occluded = nullptr;
  float min_width_distance_factor = 0;  // read only by libraries configured for it
};

/// One ray and its hit; the last part is longer than any library's configuration needs.
struct alignas(16) RayHit {
  float origin[3], t_near, direction[3], time, t_far;
  std::uint32_t mask, id, flags;
  float normal[3], u, v;
  std::uint32_t primitive, geometry, instances[9];
};

struct IntersectFunctionArguments {
  int* valid;
  void* geometry_data;
  std::uint32_t primitive;
  QueryContext* context;
  void* ray_hit;  // a RayHit where N is 1
  std::uint32_t N;
  std::uint32_t geometry;
};
using IntersectFunction = void (*)(const IntersectFunctionArguments*);

struct IntersectArguments {
  int flags = query_incoherent;
  std::uint32_t features = all_features;
  QueryContext* context = nullptr;
  void* filter = nullptr;
  IntersectFunction intersect = nullptr;
  float min_width_distance_factor = 0;
};

using ErrorFunction = void (*)(void* user, int code, const char* text);

/// The functions, by Embree's names without the prefix "rtc".
struct Functions {
  DeviceHandle* (*NewDevice)(const char* config);
  void (*ReleaseDevice)(DeviceHandle*);
  ssize_t (*GetDeviceProperty)(DeviceHandle*, DeviceProperty);
  int (*GetDeviceError)(DeviceHandle*);
  SceneHandle* (*NewScene)(DeviceHandle*);
  void (*ReleaseScene)(SceneHandle*);
  void (*SetSceneFlags)(SceneHandle*, SceneFlags);
  void (*SetSceneBuildQuality)(SceneHandle*, BuildQuality);
  void (*AttachGeometryByID)(SceneHandle*, GeometryHandle*, std::uint32_t id);
  void (*DetachGeometry)(SceneHandle*, std::uint32_t id);
  void (*CommitScene)(SceneHandle*);
  GeometryHandle* (*NewGeometry)(DeviceHandle*, GeometryType);
  void (*ReleaseGeometry)(GeometryHandle*);
  void (*SetGeometryBuildQuality)(GeometryHandle*, BuildQuality);
  void (*SetGeometryUserPrimitiveCount)(GeometryHandle*, std::uint32_t);
  void (*SetGeometryUserData)(GeometryHandle*, void*);
  void (*SetGeometryBoundsFunction)(GeometryHandle*, BoundsFunction, void*);
  void (*SetGeometryOccludedFunction)(GeometryHandle*, OccludedFunction);
  void (*SetGeometryIntersectFunction)(GeometryHandle*, IntersectFunction);
  void (*CommitGeometry)(GeometryHandle*);
  void (*Occluded16)(const int* valid, SceneHandle*, Ray16*, OccludedArguments*);
  void (*Intersect1)(SceneHandle*, RayHit*, IntersectArguments*);
};

}  // namespace rayvox::embree
