// The number of properties that hold, for people: each property counts once, whatever the number of stages that it is
// checked after.
#pragma once
#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

namespace cutproof::oracles {

// Expectations of a scene are no properties of the method; the names of their verdicts begin like this.
inline constexpr std::string_view kExpectation = "expected ";

// Properties of the judging itself, such as completeness, are no properties of the method either.
inline bool is_of_the_judging(std::string_view property) {
  for (const char* const one :
       {"something was judged", "something was compared", "the run is whole", "every property looked at something"}) {
    if (property == one) return true;
  }
  return false;
}
// Whether a wider question is asked beyond the bound of this property, which nearly all then pass: a share of its bound
// does not tell how nearly a verdict failed (tolerances.md, The step again).
inline bool asks_wider(std::string_view property) { return property == "admissible step"; }
// Whether a verdict of this name is on a state or a stage: then the stage after which it was judged is told.
inline bool is_of_a_moment(std::string_view property) {
  return !property.starts_with(kExpectation) && !is_of_the_judging(property);
}

// All verdicts of one property after one stage.
struct AfterStage {
  std::string_view property;
  bool looked = false;  // some verdict looked at something, or fails
  bool fails = false;   // and the scene does not expect it
  bool fails_as_expected = false;
};

// Of properties that judged something; of the judging itself only failures.
struct PropertyCount {
  int64_t hold = 0, fail = 0, fail_as_expected = 0;
  int64_t met = 0, unmet = 0;  // of the scene's expectations
  int64_t properties() const { return hold + fail + fail_as_expected; }
};

inline PropertyCount count_properties(const std::vector<AfterStage>& all) {
  std::map<std::string_view, AfterStage> by_name;
  for (const AfterStage& one : all) {
    AfterStage& known = by_name[one.property];
    known.looked |= one.looked;
    known.fails |= one.fails;
    known.fails_as_expected |= one.fails_as_expected;
  }
  PropertyCount count;
  for (const auto& [name, one] : by_name) {
    if (!one.looked || (is_of_the_judging(name) && !one.fails)) continue;
    if (name.starts_with(kExpectation)) {
      ++(one.fails || one.fails_as_expected ? count.unmet : count.met);
    } else {
      ++(one.fails ? count.fail : one.fails_as_expected ? count.fail_as_expected : count.hold);
    }
  }
  return count;
}

}  // namespace cutproof::oracles
