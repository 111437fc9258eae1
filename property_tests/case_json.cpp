// Cases as text.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "model/io/limits.h"
#include "model/rules.h"
#include "property_tests/cases.h"

namespace cutproof::property_tests {

NLOHMANN_JSON_SERIALIZE_ENUM(ClusterKind, {{ClusterKind::boxes, "boxes"},
                                           {ClusterKind::sampled, "sampled"},
                                           {ClusterKind::tiles, "tiles"},
                                           {ClusterKind::foreign, "foreign"}})
NLOHMANN_JSON_SERIALIZE_ENUM(Link, {{Link::apart, "apart"}, {Link::chained, "chained"}, {Link::retraced, "retraced"}})
NLOHMANN_JSON_SERIALIZE_ENUM(Removal, {{Removal::usual, "usual"},
                                       {Removal::geometric, "geometric"},
                                       {Removal::strain, "strain"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CaseWall, axis, side, offset, friction)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CaseGrip, low, high, pull, from, until, shared)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Stroke, from, to, back, down, link, tilt, along, turn)

}  // namespace cutproof::property_tests

// By their names in model/rules.h; an unknown name is read as the first value.
namespace cutproof {
template <NamedChoice E>
void to_json(nlohmann::json& json, E choice) {
  json = name_of(choice);
}
template <NamedChoice E>
void from_json(const nlohmann::json& json, E& choice) {
  choice = choice_named<E>(json.get<std::string>()).value_or(E{});
}
}  // namespace cutproof

namespace cutproof::property_tests {

void to_json(nlohmann::json& json, const Case& c) {
#define LIST(Element, name, most) FIELD(, name, , )
#define FIELD(Type, name, value, simplest) json[#name] = c.name;
#include "property_tests/case_fields.inc"
}
void from_json(const nlohmann::json& json, Case& c) {
#define LIST(Element, name, most) FIELD(, name, , )
#define FIELD(Type, name, value, simplest) json.at(#name).get_to(c.name);
#include "property_tests/case_fields.inc"
}

std::string to_json(const Case& c) { return nlohmann::json(c).dump(); }

namespace {

// Nodes of the grid in the box around them, each axis of which is within 2^20: the product fits.
int64_t cells_around(const std::vector<Node>& nodes) {
  int64_t cells = 1;
  for (std::size_t axis = 0; axis < 3 && !nodes.empty(); ++axis) {
    const auto [low, high] = extent(nodes, axis);
    cells *= int64_t{high} - low + 1;
  }
  return cells;
}

// Throws std::invalid_argument for numbers that no case can have.
void require_sane(const Case& c) {
  const auto require = [](bool holds, const char* field, const std::string& what) {
    if (!holds) throw std::invalid_argument(std::string(field) + " must be " + what);
  };
  constexpr int32_t kFarthest = 1 << 20;  // [quarters]; a grid beyond that fits no memory
  const auto is_near = [](const std::array<int32_t, 3>& p, int32_t low) {
    return std::all_of(p.begin(), p.end(), [&](int32_t q) { return q >= low && q <= kFarthest; });
  };
  require(std::is_sorted(c.nodes.begin(), c.nodes.end()) &&
              std::adjacent_find(c.nodes.begin(), c.nodes.end()) == c.nodes.end() &&
              std::all_of(c.nodes.begin(), c.nodes.end(), [&](const Node& n) { return is_near(n, 0); }),
          "nodes", "ascending, without duplicates, between 0 and 2^20");
#define FIELD(Type, name, value, simplest)
#define LIST(Element, name, most) require(c.name.size() <= most, #name, std::to_string(most) + " at most");
#define NUMBER(name, value, simplest, least, most) \
  require(least <= c.name && c.name <= most, #name, "in [" + std::to_string(least) + ", " + std::to_string(most) + "]");
#include "property_tests/case_fields.inc"
  require(cells_around(c.nodes) <= io::kMostCaseCells, "nodes", "nearer to each other");
  require(c.spacing > 0 && c.spacing <= 1e6, "spacing", "in (0, 1e6]");
  const auto is_within = [](const std::array<int32_t, 3>& v, int32_t most) {
    return std::all_of(v.begin(), v.end(), [&](int32_t q) { return -most <= q && q <= most; });
  };
  for (const Stroke& stroke : c.strokes) {
    require(stroke.back >= 0 && stroke.back < 6, "strokes.back", "in [0, 5]");
    require(is_near(stroke.from, -kFarthest) && is_near(stroke.to, -kFarthest), "strokes", "within 2^20 of the origin");
    require(is_within(stroke.tilt, 3), "strokes.tilt", "within -3 .. 3");
    require(is_within(stroke.along, 1000), "strokes.along", "within -1000 .. 1000");
    // Less than half a turn, so that a blade that takes one substep turns the way that was meant.
    require(is_within(stroke.turn, 180), "strokes.turn", "within -180 .. 180");
  }
  require(is_within(c.gravity, 10'000), "gravity", "within -10000 .. 10000");
  for (const CaseWall& wall : c.walls) {
    require(wall.axis >= 0 && wall.axis < 3, "walls.axis", "0, 1 or 2");
    require(wall.side == 1 || wall.side == -1, "walls.side", "1 or -1");
    require(std::abs(int64_t{wall.offset}) <= 4 * int64_t{kFarthest}, "walls.offset", "within 2^22 of the origin");
    require(wall.friction >= 0 && wall.friction <= 10'000, "walls.friction", "in [0, 10000]");
  }
  for (const CaseGrip& grip : c.grips) {
    require(is_within(grip.low, kFarthest) && is_within(grip.high, kFarthest), "grips", "within 2^20 of the origin");
    require(is_within(grip.pull, 1000), "grips.pull", "within -1000 .. 1000");
    require(grip.from >= 0 && grip.until >= -1, "grips.from and until", ">= 0 (until: >= -1)");
  }
}

}  // namespace

Case from_json(const std::string& text) {
  try {
    const auto document = nlohmann::json::parse(text);
    const Case c = document.get<Case>();
    // nlohmann accepts some errors, such as an unknown rule; these do not survive writing and reading.
    const nlohmann::json again = c;
    for (const auto& [key, value] : document.items()) {
      if (!again.contains(key)) throw std::invalid_argument("there is no field '" + key + "'");
      if (again[key] != value) throw std::invalid_argument(key + ": " + value.dump().substr(0, 60) + " is not known");
    }
    require_sane(c);
    return c;
  } catch (const nlohmann::json::exception& error) {
    throw std::invalid_argument(std::string("This is not a case of the property tests: ") + error.what());
  }
}

}  // namespace cutproof::property_tests
