#pragma once
// The little a test needs: facts with names, and a failure that says which and where.
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

namespace check {

struct Fact {
  const char* name;
  std::function<void()> body;
};

inline std::vector<Fact>& facts() {
  static std::vector<Fact> all;
  return all;
}

inline int failures = 0;

inline void fail(const char* file, int line, const std::string& text) {
  // A property that fails for many samples says so a few times.
  if (++failures <= 20) std::fprintf(stderr, "%s:%d: %s\n", file, line, text.c_str());
}

struct Register {
  Register(const char* name, std::function<void()> body) { facts().push_back({name, std::move(body)}); }
};

inline int run() {
  for (const Fact& fact : facts()) {
    const int before = failures;
    fact.body();
    std::printf("%s %s\n", failures == before ? "ok    " : "FAILED", fact.name);
  }
  std::printf("%zu facts, %d failures\n", facts().size(), failures);
  return failures == 0 && !facts().empty() ? 0 : 1;
}

}  // namespace check

#define FACT(name)                                           \
  static void name();                                        \
  static const check::Register register_##name(#name, name); \
  static void name()
#define CHECK(condition)                                                        \
  do {                                                                          \
    if (!(condition)) check::fail(__FILE__, __LINE__, "not true: " #condition); \
  } while (false)
#define CHECK_EQUAL(a, b)                                                                                    \
  do {                                                                                                       \
    const auto left_ = (a);                                                                                  \
    const auto right_ = (b);                                                                                 \
    if (!(left_ == right_)) {                                                                                \
      check::fail(__FILE__, __LINE__,                                                                        \
                  std::string(#a " is ") + std::to_string(left_) + ", " #b " is " + std::to_string(right_)); \
    }                                                                                                        \
  } while (false)
#define CHECK_THROWS(type, expression)                                                      \
  do {                                                                                      \
    bool thrown_ = false;                                                                   \
    try {                                                                                   \
      (void)(expression);                                                                   \
    } catch (const type&) {                                                                 \
      thrown_ = true;                                                                       \
    }                                                                                       \
    if (!thrown_) check::fail(__FILE__, __LINE__, "did not throw " #type ": " #expression); \
  } while (false)

int main() { return check::run(); }
