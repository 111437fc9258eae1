#include "oracles/runs/run_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>
#include <utility>

#include "model/at.h"
#include "model/error.h"

namespace cutproof::oracles {
namespace {

constexpr const char* kWords =
    "Use same, reset, checkpoint, split, refine, permute, units:4,1,1 (length, time, mass), mirror:x, rotate:90z, "
    "shift:X,Y,Z or boost:X,Y,Z.";

[[noreturn]] void refuse_map(const std::string& word) {
  throw InputError("--map", "", fmt::format("'{}' is no map.", word), kWords);
}

std::optional<Vec3> three_numbers(std::string_view text) {
  Vec3 numbers;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t end = std::min(text.find(','), text.size());
    const auto [stop, error] = std::from_chars(text.data(), text.data() + end, numbers[axis]);
    if (error != std::errc{} || stop != text.data() + end || !std::isfinite(numbers[axis])) return std::nullopt;
    if ((end == text.size()) != (axis == 2)) return std::nullopt;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return numbers;
}

int axis_of(std::string_view letter) { return letter == "x" ? 0 : letter == "y" ? 1 : letter == "z" ? 2 : -1; }

bool is_power_of_two(double value) {
  int exponent = 0;
  return std::frexp(value, &exponent) == 0.5;
}

struct NamedRule {
  std::string_view name;
  ArrayRule rule;
};
constexpr Dimension kNone, kLength = {1, 0, 0}, kTime = {0, 1, 0}, kMass = {0, 0, 1};
constexpr NamedRule kRules[] = {
    {"rest", {Follows::point, kLength, true, true}},
    {"mass", {Follows::scalar, kMass, true, true}},
    {"gravity", {Follows::direction, {1, -2, 0}, true}},
    {"spacing", {Follows::scalar, kLength, true}},
    {"steps", {Follows::nothing, kNone, true}},
    {"damping", {Follows::scalar, {0, -1, 0}, true}},
    {"edges", {Follows::nothing, kNone, true, false, true}},
    {"nodes", {Follows::lattice, kNone, true, true}},
    {"cut_resolution", {Follows::scalar, kLength, true}},
    {"unit_roundoff", {Follows::nothing, kNone, true}},
    {"positions", {Follows::point, kLength, true, true}},
    {"time", {Follows::scalar, kTime, true}},
    {"velocities", {Follows::velocity, {1, -1, 0}, true, true}},
    {"alive", {Follows::nothing, kNone, true, true}},
    {"held", {Follows::nothing, kNone, true, true}},
    {"removed", {Follows::nothing, kNone, true, true}},
    {"contact_impulse", {Follows::direction, {1, -1, 1}, true}},
    {"spin", {Follows::axial, {2, -1, 1}, true, true}},
    {"energy", {Follows::scalar, {2, -2, 1}, true}},
    {"blade", {Follows::point, kLength, true}},
    {"groups_offsets", {Follows::nothing, kNone, true}},
    {"groups_members", {Follows::nothing, kNone, true, false, true}},
    {"groups_weights", {Follows::nothing, kNone, true}},
    {"cells", {Follows::nothing, kNone, true, false, true}},
    {"parent", {Follows::nothing, kNone, true, true, true}},
    {"piece", {Follows::nothing, kNone, true, true}},
    {"permutation", {Follows::nothing, kNone, true, true, true}},
    {"vertices", {Follows::point, kLength, true}},
    {"triangles", {Follows::nothing, kNone, true}},
};

void set_number(Array& array, int64_t k, double value) {
  const auto store = [&]<class T>(T element) {
    std::memcpy(array.bytes.data() + at(k) * sizeof(T), &element, sizeof(T));
  };
  switch (array.type) {
    case ElementType::i32:
      return store(static_cast<int32_t>(value));
    case ElementType::i64:
      return store(static_cast<int64_t>(value));
    case ElementType::u8:
      return store(static_cast<uint8_t>(value));
    case ElementType::f32:
      return store(static_cast<float>(value));
    case ElementType::f64:
      return store(value);
  }
}

// What one array becomes that is not permuted.
class Mapping {
 public:
  Mapping(const RunMap& map, const Arrays& input, const std::string& file) : map_(map), input_(input), file_(file) {}

  Array mapped(Array array, const ArrayRule& rule) const {
    if (rule.how == Follows::scalar) {
      for (int64_t k = 0; k < array.count(); ++k) set_number(array, k, map_.scale(rule.of) * array.number(k));
    } else if (rule.how != Follows::nothing) {
      if (array.shape.empty() || array.shape.back() != 3) refuse(array, "Its entries are no vectors.", "Write (…, 3).");
      if (rule.how == Follows::lattice && map_.name() == "shift")
        refuse(array, "Whole numbers do not follow a shift.", "Write rest instead.");
      if (rule.how == Follows::lattice && array.type == ElementType::u8)
        refuse(array, "Bytes have no sign.", "Write 32-bit integers.");
      for (int64_t k = 0; k < array.count(); k += 3) {
        const Vec3 made = map_.mapped({array.number(k), array.number(k + 1), array.number(k + 2)}, rule.how, rule.of,
                                      time_of(array, k));
        for (int axis = 0; axis < 3; ++axis) set_number(array, k + axis, made[axis]);
      }
    }
    if (map_.reverses() && (array.name == "cells" || array.name == "triangles")) reverse(array);
    return array;
  }

 private:
  [[noreturn]] void refuse(const Array& array, const std::string& problem, const std::string& remedy) const {
    throw InputError(file_, array.name, problem, remedy);
  }
  // When an entry is, by `time` where there are frames; what has none is at the beginning.
  double time_of(const Array& array, int64_t k) const {
    const Array* const time = find_array(input_, "time");
    if (!map_.needs_time() || time == nullptr || time->count() == 0) return 0;
    const bool by_frame = array.name != "rest" && array.shape[0] == time->count() &&
                          array.shape.size() >= (array.name == "blade" ? 4u : 3u);
    return time->number(by_frame ? k / std::max<int64_t>(array.columns(), 1) : 0);
  }
  // Cells and triangles of a mirror image with their volume or normal as before.
  static void reverse(Array& array) {
    const int64_t corners = array.shape.back();
    for (int64_t k = 0; k + corners <= array.count(); k += corners) {
      const auto swap = [&](int64_t i, int64_t j) {
        const double first = array.number(k + i);
        set_number(array, k + i, array.number(k + j));
        set_number(array, k + j, first);
      };
      if (corners == 8) {
        for (int64_t i = 0; i < 4; ++i) swap(i, i + 4);
      } else {
        swap(corners - 2, corners - 1);
      }
    }
  }

  const RunMap& map_;
  const Arrays& input_;
  const std::string& file_;
};

using Rules = std::vector<std::pair<std::string, ArrayRule>>;
ArrayRule rule_among(const Rules& more, const std::string& array) {
  const auto given = std::find_if(more.begin(), more.end(), [&](const auto& rule) { return rule.first == array; });
  return given == more.end() ? rule_of(array) : given->second;
}

int64_t particles_of(const Arrays& input, const std::string& file) {
  for (const std::string_view name : {"rest", "positions", "mass"}) {
    if (const Array* const array = find_array(input, name)) {
      const bool is_vector = name != "mass";
      const std::size_t behind = is_vector ? 2 : 1;
      if (array->shape.size() >= behind) return array->shape[array->shape.size() - behind];
    }
  }
  throw InputError(file, "rest", "Nothing says how many particles there are.", "Write rest, positions or mass.");
}

void permute(Arrays& arrays, const Rules& more, uint64_t seed, const std::string& file) {
  const int64_t n = particles_of(arrays, file);
  std::vector<int32_t> was(at(n)), becomes(at(n));  // of new numbers; of old ones
  std::iota(was.begin(), was.end(), 0);
  std::mt19937_64 random(seed);
  for (int64_t i = n - 1; i > 0; --i) std::swap(was[at(i)], was[at(static_cast<int64_t>(random() % at(i + 1)))]);
  for (int64_t i = 0; i < n; ++i) becomes[at(was[at(i)])] = static_cast<int32_t>(i);
  for (Array& array : arrays) {
    const ArrayRule rule = rule_among(more, array.name);
    if (rule.of_particles) {
      for (int64_t k = 0; k < array.count(); ++k) {
        const int64_t i = array.integer(k);
        if (i >= n)
          throw InputError(file, array.name, fmt::format("It names particle {}.", i), "Name those there are.");
        if (i >= 0) set_number(array, k, becomes[at(i)]);
      }
    }
    if (!rule.by_particle) continue;
    const bool is_vector = rule.how != Follows::nothing && rule.how != Follows::scalar;
    const std::size_t width = is_vector ? 3 * at(size_of(array.type)) : at(size_of(array.type));
    if (array.bytes.size() % (at(n) * width) != 0)
      throw InputError(file, array.name, fmt::format("It has no entry for each of {} particles.", n), "Write (n, …).");
    const std::vector<std::byte> old = array.bytes;
    for (std::size_t begin = 0; begin < old.size(); begin += at(n) * width) {
      for (std::size_t i = 0; i < at(n); ++i)
        std::memcpy(array.bytes.data() + begin + i * width, old.data() + begin + at(was[i]) * width, width);
    }
  }
  std::erase_if(arrays, [](const Array& array) { return array.name == "permutation"; });
  arrays.push_back(make_array("permutation", {n}, was));
}

}  // namespace

RunMap RunMap::parse(const std::string& word) {
  RunMap map;
  const std::size_t colon = word.find(':');
  map.name_ = word.substr(0, colon);
  const std::string rest = colon == std::string::npos ? "" : word.substr(colon + 1);
  if (map.name_ == "units" || map.name_ == "shift" || map.name_ == "boost") {
    const std::optional<Vec3> given = three_numbers(rest);
    if (!given) refuse_map(word);
    if (map.name_ == "units") {
      if (!(given->x > 0 && given->y > 0 && given->z > 0)) refuse_map(word);
      map.length_ = given->x, map.time_ = given->y, map.mass_ = given->z;
      map.is_exact_ = is_power_of_two(given->x) && is_power_of_two(given->y) && is_power_of_two(given->z);
      return map;
    }
    (map.name_ == "shift" ? map.shift_ : map.boost_) = *given;
    map.is_exact_ = *given == Vec3{};
    return map;
  }
  if (map.name_ == "mirror") {
    const int axis = axis_of(rest);
    if (axis < 0) refuse_map(word);
    map.signs_[at(axis)] = -1;
    return map;
  }
  if (map.name_ == "rotate") {
    const int axis = rest.empty() ? -1 : axis_of(rest.substr(rest.size() - 1));
    const std::string angle = rest.empty() ? "" : rest.substr(0, rest.size() - 1);
    const int quarters = angle == "90" ? 1 : angle == "180" ? 2 : angle == "270" ? 3 : 0;
    if (axis < 0 || quarters == 0) refuse_map(word);
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (quarters % 2 == 1) {
      std::swap(map.axes_[at(u)], map.axes_[at(v)]);
      map.parity_ = -1;
      map.signs_[at(quarters == 1 ? u : v)] = -1;  // a quarter turn: u' = -v, v' = u
    } else {
      map.signs_[at(u)] = map.signs_[at(v)] = -1;
    }
    return map;
  }
  if (map.name_ == "permute") {
    if (colon == std::string::npos) return map;
    const auto [stop, error] = std::from_chars(rest.data(), rest.data() + rest.size(), map.seed_);
    if (error != std::errc{} || stop != rest.data() + rest.size()) refuse_map(word);
    return map;
  }
  const bool is_known = map.name_ == "same" || map.name_ == "reset" || map.name_ == "checkpoint" ||
                        map.name_ == "split" || map.name_ == "refine";
  if (!is_known || colon != std::string::npos) refuse_map(word);
  return map;
}

double RunMap::scale(Dimension of) const {
  const auto power = [](double base, int exponent) {
    double product = 1;
    for (int k = 0; k < std::abs(exponent); ++k) product *= base;
    return exponent < 0 ? 1 / product : product;
  };
  return power(length_, of.length) * power(time_, of.time) * power(mass_, of.mass);
}

Vec3 RunMap::mapped(Vec3 entry, Follows how, Dimension of, double time) const {
  Vec3 turned;
  for (int axis = 0; axis < 3; ++axis) turned[axis] = signs_[at(axis)] * entry[axes_[at(axis)]];
  if (how == Follows::lattice) return turned;
  turned = scale(of) * turned;
  if (how == Follows::axial && reverses()) return -turned;
  if (how == Follows::velocity) return is_exact_ ? turned : turned + boost_;
  if (how == Follows::point && !is_exact_) return turned + shift_ + time * boost_;
  return turned;
}

ArrayRule rule_of(std::string_view array) {
  const auto found =
      std::find_if(std::begin(kRules), std::end(kRules), [&](const NamedRule& r) { return r.name == array; });
  return found == std::end(kRules) ? ArrayRule{} : found->rule;
}

Arrays mapped_input(const RunMap& map, const Arrays& input, const std::vector<std::pair<std::string, ArrayRule>>& more,
                    const std::string& file) {
  if (map.needs_time() && find_array(input, "blade") != nullptr && find_array(input, "time") == nullptr)
    throw InputError(file, "time", "A blade that is boosted needs to know when it sweeps.", "Write time.");
  const Mapping mapping(map, input, file);
  Arrays made;
  for (const Array& array : input) {
    const ArrayRule rule = rule_among(more, array.name);
    if (!rule.known) {
      throw InputError(file, array.name, "How it follows a map is not known.",
                       fmt::format("Say its powers of length, time and mass, as --dimension {}=-1,-2,1.", array.name));
    }
    made.push_back(mapping.mapped(array, rule));
  }
  if (map.name() == "permute") permute(made, more, map.seed(), file);
  return made;
}

}  // namespace cutproof::oracles
