#include "rayvox/ray_shooting/embree_library.hpp"

#include <dlfcn.h>

#include <mutex>

#include "rayvox/error.hpp"

namespace rayvox {
namespace {

constexpr const char* remedy = "; the Embree engine needs Embree 4: pip install embreex";

std::mutex loading;
const EmbreeLibrary* loaded = nullptr;

template <class Function>
void resolve(void* handle, const std::string& path, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(handle, name));
  if (!function) throw EngineUnavailable(path + " has no " + name + remedy);
}

}  // namespace

EmbreeLibrary::EmbreeLibrary(void* handle, const std::string& path) {
#define RAYVOX_RESOLVE(name) resolve(handle, path, "rtc" #name, functions_.name)
  RAYVOX_RESOLVE(NewDevice);
  RAYVOX_RESOLVE(ReleaseDevice);
  RAYVOX_RESOLVE(GetDeviceProperty);
  RAYVOX_RESOLVE(GetDeviceError);
  RAYVOX_RESOLVE(NewScene);
  RAYVOX_RESOLVE(ReleaseScene);
  RAYVOX_RESOLVE(SetSceneFlags);
  RAYVOX_RESOLVE(SetSceneBuildQuality);
  RAYVOX_RESOLVE(AttachGeometryByID);
  RAYVOX_RESOLVE(DetachGeometry);
  RAYVOX_RESOLVE(CommitScene);
  RAYVOX_RESOLVE(NewGeometry);
  RAYVOX_RESOLVE(ReleaseGeometry);
  RAYVOX_RESOLVE(SetGeometryBuildQuality);
  RAYVOX_RESOLVE(SetGeometryUserPrimitiveCount);
  RAYVOX_RESOLVE(SetGeometryUserData);
  RAYVOX_RESOLVE(SetGeometryBoundsFunction);
  RAYVOX_RESOLVE(SetGeometryOccludedFunction);
  RAYVOX_RESOLVE(SetGeometryIntersectFunction);
  RAYVOX_RESOLVE(CommitGeometry);
  RAYVOX_RESOLVE(Occluded16);
  RAYVOX_RESOLVE(Intersect1);
#undef RAYVOX_RESOLVE
  device_ = functions_.NewDevice(nullptr);
  if (!device_) throw EngineUnavailable(path + " made no device" + remedy);
  const auto number = functions_.GetDeviceProperty(device_, embree::version_number);
  version_ =
      std::to_string(number / 10000) + "." + std::to_string(number / 100 % 100) + "." + std::to_string(number % 100);
  if (number / 10000 != 4 || !functions_.GetDeviceProperty(device_, embree::user_geometry_supported)) {
    functions_.ReleaseDevice(device_);
    throw EngineUnavailable(path + " is Embree " + version_ + ", not Embree 4 with user geometry" + remedy);
  }
}

void EmbreeLibrary::load(const std::vector<std::string>& paths) {
  const std::lock_guard lock(loading);
  if (loaded) return;
  std::vector<std::string> candidates = paths;
  candidates.push_back("libembree4.so.4");
  std::string reason;
  for (const std::string& path : candidates) {
    if (void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {
      loaded = new EmbreeLibrary(handle, path);
      return;
    }
    reason = dlerror();
  }
  throw EngineUnavailable(reason + remedy);
}

const EmbreeLibrary& EmbreeLibrary::get() {
  load({});
  return *loaded;
}

}  // namespace rayvox
