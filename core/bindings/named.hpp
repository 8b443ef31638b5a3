#pragma once
// Options that Python names.
#include <cstddef>
#include <string>
#include <utility>

#include "rayvox/collision/collide.hpp"
#include "rayvox/error.hpp"

namespace rayvox::bindings {

template <class T, std::size_t n>
T by_name(const std::string& name, const char* what, const std::pair<const char*, T> (&values)[n]) {
  std::string known;
  for (const auto& [text, value] : values) {
    if (name == text) return value;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  throw InvalidInput(std::string(what) + " must be one of " + known + "; got " + name);
}

inline Contacts contacts_named(const std::string& name) {
  return by_name<Contacts>(name, "contacts",
                           {{"none", Contacts::none}, {"first", Contacts::first}, {"all", Contacts::all}});
}

}  // namespace rayvox::bindings
