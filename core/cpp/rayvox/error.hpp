#pragma once
// The kernel's exception tree. Python sees one class for each (rayvox.errors).
#include <stdexcept>

namespace rayvox {

struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// An argument that can never be valid: wrong shape, NaN, a pose that is not rigid.
struct InvalidInput : Error {
  using Error::Error;
};
/// A coordinate beyond the octree's range.
struct OutOfRange : InvalidInput {
  using InvalidInput::InvalidInput;
};
/// Bytes that are not the map format they claim to be.
struct MapFormatError : Error {
  using Error::Error;
};
/// A ray-shooting engine whose library is not installed.
struct EngineUnavailable : Error {
  using Error::Error;
};
/// Work that was given up because its CancellationToken said so.
struct Cancelled : Error {
  using Error::Error;
};

}  // namespace rayvox
