// The list of all fields of a State. Code that compares, digests, records, corrupts or transforms states walks this
// list and names no field.
#pragma once
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

#include "model/stage.h"
#include "model/state.h"

namespace cutproof {

// The entities that a field has entries for.
enum class IndexSpace {
  state,        // one value, or a list of its own length
  particle,     // [n]
  cluster,      // [m]
  cluster_end,  // [m + 1]
  member,       // [offsets[m]]
  vertex,       // [v]
  triangle      // [t]
};

// The kind of a value: how it changes where the body is turned, shifted, scaled or renumbered.
enum class Quantity { number, particle, vertices, flag, mass, point, velocity, momentum, rotation, direction };

// Groups of fields, as bits: the input of a verdict.
enum Part : unsigned {
  kMotion = 1,      // x, v, impulse
  kAlive = 2,       // alive
  kCut = 4,         // removed, debris
  kSets = 8,        // offsets and members of clusters
  kFrames = 16,     // rest centers and masses
  kRotations = 32,  // rotations and degenerate flags
  kSkin = 64,
  kLimits = 128,   // tau, cap, edge_covered
  kNumbers = 256,  // numbers of clusters
  kTime = 512,     // frame
  kAll = 1023
};

// Stages as a set.
struct StageSet {
  unsigned bits = 0;
  constexpr bool contains(Stage stage) const { return (bits >> static_cast<unsigned>(stage) & 1u) != 0; }
};
template <class... S>
constexpr StageSet stages(S... stage) {
  return {((1u << static_cast<unsigned>(stage)) | ... | 0u)};
}

struct Field {
  std::string_view name;  // in files
  std::string_view text;  // one entry, for a person: "a position"
  IndexSpace space;
  Quantity quantity;
  std::string_view unit;  // "1" for counts, flags and numbers
  Part part;
  StageSet changed_by;            // no other stage may change a bit of it
  std::string_view derived_from;  // "": it is not; else what determines it
  // Whether two correct backends must agree to the bit (decisions) or within a distance (computed values).
  bool is_decision;
};

// visit(field, get) for each field, in a fixed order. get(state) is a reference to the field of a State or const State.
template <class Visit>
constexpr void for_each_field(Visit&& visit) {
  using enum IndexSpace;
  using Q = Quantity;
  using enum Stage;
  constexpr StageSet cluster_stages = stages(split, merge, expand), shape_stages = stages(step, split, merge);
  constexpr StageSet none = stages(), by_skin = stages(skin);
#define CUTPROOF_FIELD(member, ...) \
  visit(                            \
      Field{__VA_ARGS__}, [](auto& s) -> auto& { return s.member; })
  CUTPROOF_FIELD(frame, "frame", "the frame", state, Q::number, "1", kTime, by_skin, "", true);
  CUTPROOF_FIELD(tau, "tau", "tau", state, Q::number, "1", kLimits, none, "", true);
  CUTPROOF_FIELD(cap, "cap", "cap", state, Q::number, "1", kLimits, none, "", true);
  CUTPROOF_FIELD(edge_covered, "edge_covered", "edge_covered", state, Q::flag, "1", kLimits, stages(expand),
                 "alive, members", true);
  CUTPROOF_FIELD(impulse, "impulse", "the impulse", state, Q::momentum, "kg m/s", kMotion, stages(step), "", false);
  CUTPROOF_FIELD(x, "position", "a position", particle, Q::point, "m", kMotion, stages(step), "", false);
  CUTPROOF_FIELD(v, "velocity", "a velocity", particle, Q::velocity, "m/s", kMotion, stages(step), "", false);
  CUTPROOF_FIELD(alive, "alive", "alive", particle, Q::flag, "1", kAlive, stages(detect, split), "", true);
  CUTPROOF_FIELD(removed, "removed", "the list of removed particles", state, Q::particle, "1", kCut,
                 stages(step, detect), "", true);
  CUTPROOF_FIELD(debris, "debris", "the list of debris", state, Q::particle, "1", kCut, stages(step, split), "", true);
  CUTPROOF_FIELD(clusters.offsets, "offsets", "a cluster's extent", cluster_end, Q::number, "1", kSets, cluster_stages,
                 "", true);
  CUTPROOF_FIELD(clusters.members, "members", "a cluster's members", member, Q::particle, "1", kSets, cluster_stages,
                 "", true);
  CUTPROOF_FIELD(clusters.number, "number", "a cluster's number", cluster, Q::number, "1", kNumbers,
                 stages(split, merge, skin), "", true);
  CUTPROOF_FIELD(clusters.rest_center, "rest_center", "a rest center", cluster, Q::point, "m", kFrames, cluster_stages,
                 "members", false);
  CUTPROOF_FIELD(clusters.mass, "mass", "a cluster's mass", cluster, Q::mass, "kg", kFrames, cluster_stages, "members",
                 false);
  CUTPROOF_FIELD(clusters.rotation, "rotation", "a rotation", cluster, Q::rotation, "1", kRotations, shape_stages, "",
                 false);
  CUTPROOF_FIELD(clusters.degenerate, "degenerate", "a degenerate flag", cluster, Q::flag, "1", kRotations,
                 shape_stages, "", false);
  CUTPROOF_FIELD(skin.owner, "owner", "a skin vertex's owner", vertex, Q::particle, "1", kSkin, by_skin, "alive", true);
  CUTPROOF_FIELD(skin.direction, "direction", "a skin vertex's direction", vertex, Q::direction, "1", kSkin, by_skin,
                 "alive", true);
  CUTPROOF_FIELD(skin.reach, "reach", "a skin vertex's reach", vertex, Q::number, "h", kSkin, by_skin, "", false);
  CUTPROOF_FIELD(skin.position, "skin_position", "a skin vertex's position", vertex, Q::point, "m", kSkin, by_skin,
                 "x, rotation, rest_center, members", false);
  CUTPROOF_FIELD(skin.triangles, "triangles", "a skin triangle", triangle, Q::vertices, "1", kSkin, by_skin, "alive",
                 true);
#undef CUTPROOF_FIELD
}

namespace fields_detail {
// Does not compile when a member is added or taken away: then the list above is to be changed as well.
inline void know_every_member(const State& state) {
  [[maybe_unused]] const auto& [frame, x, v, alive, removed, debris, clusters, tau, cap, edge_covered, impulse, skin,
                                precision, place_rounding] = state;
  [[maybe_unused]] const auto& [offsets, members, number, rotation, rest_center, mass, degenerate] = clusters;
  [[maybe_unused]] const auto& [owner, direction, reach, position, triangles] = skin;
}
}  // namespace fields_detail

// Number of entries of a field of an index space in a well-formed state; without a meaning for IndexSpace::state.
inline int64_t count_of(IndexSpace space, const State& state) {
  const auto clusters = std::ssize(state.clusters.number);
  // In the order of IndexSpace.
  const std::array<int64_t, 7> counts = {0,
                                         std::ssize(state.x),
                                         clusters,
                                         clusters + 1,
                                         std::ssize(state.clusters.members),
                                         std::ssize(state.skin.owner),
                                         std::ssize(state.skin.triangles)};
  return counts[static_cast<std::size_t>(space)];
}

// Equal bits, where == would call NaN unequal to itself and -0 equal to 0.
template <class T>
requires std::is_trivially_copyable_v<T>
bool same_bits(const T& a, const T& b) { return std::memcmp(&a, &b, sizeof(T)) == 0; }
template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

// The parts in which two states differ by a bit.
inline unsigned parts_that_differ(const State& a, const State& b) {
  unsigned parts = 0;
  for_each_field([&](const Field& field, auto get) {
    if ((parts & field.part) == 0 && !same_bits(get(a), get(b))) parts |= field.part;
  });
  return parts;
}
inline bool same_bits(const State& a, const State& b) { return parts_that_differ(a, b) == 0; }

}  // namespace cutproof
