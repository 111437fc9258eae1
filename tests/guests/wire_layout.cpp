// Prints what guests/wire.h says, as JSON: python_test.py compares it with what cutproof.py repeats. A member that is
// added there and not here changes a size, which is found as well.
#include <cstddef>
#include <cstdio>

#include "guests/wire.h"
#include "model/arrays.h"

namespace {

using namespace cutproof;
using namespace cutproof::guests;

bool first = true;
void say(const char* name, long long value) {
  std::printf("%s\"%s\": %lld", first ? "{" : ", ", name, value);
  first = false;
}

}  // namespace

#define SAY(value) say(#value, static_cast<long long>(value))
#define MEMBER(type, member)                                      \
  say(#type "." #member " offset", offsetof(wire::type, member)), \
      say(#type "." #member " size", sizeof(wire::type::member))

int main() {
  SAY(wire::kProtocol), SAY(wire::kPage), SAY(wire::kArrayBytes), SAY(wire::kArenaBytes), SAY(wire::kArenaCount);
  SAY(wire::kMemoryBytes), SAY(wire::kLeastGap), SAY(wire::kCanary), SAY(wire::kDeviceCanary), SAY(wire::kMostArrays);
  SAY(wire::kMostGrown), SAY(wire::rotations), SAY(wire::components), SAY(wire::surface), SAY(wire::clusters),
      SAY(wire::dissect);
  SAY(wire::Role::given), SAY(wire::Role::answer), SAY(wire::Role::grown), SAY(wire::Role::setup);
  SAY(wire::Outcome::answered), SAY(wire::Outcome::refused), SAY(wire::Outcome::broke_a_rule);
  SAY(wire::Outcome::device_failed), SAY(wire::Greeting::ready);
  SAY(ElementType::i32), SAY(ElementType::i64), SAY(ElementType::u8), SAY(ElementType::f32), SAY(ElementType::f64);
  for (const bool at_end : {false, true}) {
    for (const long long bytes : {0LL, 1LL, 4096LL, 5000LL}) {
      const wire::Place place = wire::place_in_arena(3, bytes, at_end);
      char name[64];
      std::snprintf(name, sizeof name, "place of %lld, %s", bytes, at_end ? "at the end" : "at the beginning");
      say(name, place.offset);
      std::snprintf(name, sizeof name, "first page of %lld, %s", bytes, at_end ? "at the end" : "at the beginning");
      say(name, place.first_page);
      std::snprintf(name, sizeof name, "end page of %lld, %s", bytes, at_end ? "at the end" : "at the beginning");
      say(name, place.end_page);
    }
  }
  say("Array size", sizeof(wire::Array)), say("Request size", sizeof(wire::Request));
  say("Reply size", sizeof(wire::Reply)), say("Hello size", sizeof(wire::Hello));
  MEMBER(Array, name), MEMBER(Array, type), MEMBER(Array, role), MEMBER(Array, rows), MEMBER(Array, columns);
  MEMBER(Array, offset), MEMBER(Array, first_page), MEMBER(Array, end_page), MEMBER(Array, arena);
  MEMBER(Request, operation), MEMBER(Request, instance), MEMBER(Request, first), MEMBER(Request, last);
  MEMBER(Request, at_end), MEMBER(Request, array_count), MEMBER(Request, arrays);
  MEMBER(Reply, outcome), MEMBER(Reply, code), MEMBER(Reply, rows), MEMBER(Reply, offset), MEMBER(Reply, text);
  MEMBER(Hello, protocol), MEMBER(Hello, greeting), MEMBER(Hello, memory), MEMBER(Hello, operations);
  MEMBER(Hello, spans), MEMBER(Hello, device), MEMBER(Hello, real), MEMBER(Hello, has_promises);
  MEMBER(Hello, remembers_faults), MEMBER(Hello, request_bytes), MEMBER(Hello, reply_bytes), MEMBER(Hello, name);
  MEMBER(Hello, version), MEMBER(Hello, promises), MEMBER(Hello, limits), MEMBER(Hello, text);
  std::printf("}\n");
}
