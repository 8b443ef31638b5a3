#pragma once
#include <string>
#include <vector>

#include "rayvox/ray_shooting/embree_abi.hpp"

namespace rayvox {

/// Embree 4, found at run time: nothing but the Embree engine needs it. Held until the process ends.
class EmbreeLibrary {
 public:
  /// Takes the first of these shared libraries that loads, then the loader's own libembree4.so.4; later calls change
  /// nothing once one was taken. Throws EngineUnavailable, saying what to install, if none does or the one found is not
  /// Embree 4 with user geometry.
  static void load(const std::vector<std::string>& paths);
  /// The library taken, after load({}) if none was. Throws as load.
  static const EmbreeLibrary& get();

  const embree::Functions& call() const { return functions_; }
  embree::DeviceHandle* device() const { return device_; }
  /// Such as "4.4.0".
  const std::string& version() const { return version_; }

 private:
  EmbreeLibrary(void* handle, const std::string& path);

  embree::Functions functions_{};
  embree::DeviceHandle* device_ = nullptr;
  std::string version_;
};

}  // namespace rayvox
