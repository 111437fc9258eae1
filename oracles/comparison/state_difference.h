// Differences of two states: walks model/fields.h and names no field. Two correct backends have the same bits in
// decisions, and near values in computed fields (Field::is_decision).
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/fields.h"
#include "model/setup.h"
#include "model/state.h"
#include "model/verdict.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::oracles {

// --- Bits ------------------------------------------------------------------------------------------------------------

struct FieldDifference {
  std::string_view field;  // Field::name
  std::string_view text;   // Field::text
  IndexSpace space;
  bool is_decision;
  bool is_list;
  int64_t index = 0;  // of the first entry that differs, or that only one of the two has; 0 of a single value
};
// The fields, in the order of model/fields.h, that differ by a bit; and the first of them. `rounded_once`: velocities
// and momenta may differ as if those of `actual` had been rounded to single precision (each component once, sums of
// them in parts, so twice half a unit in the last place).
std::vector<FieldDifference> differences_in_bits(const State& expected, const State& actual, bool rounded_once = false);
std::optional<FieldDifference> first_difference_in_bits(const State& expected, const State& actual,
                                                        bool rounded_once = false);

// --- Decisions -------------------------------------------------------------------------------------------------------

// A difference for which there is no "close".
struct DecisionDifference : Witness {
  std::string_view field = {};  // Field::name of the first that shows it; empty if it is none of a state
};
// Whether clusters and derived fields are compared: a rule may allow several answers (model/rules.h).
enum class Sets { compared, open };
// The first difference in what is decided, causes before what follows from them: frame, removed particles and debris,
// alive particles, tau and cap, clusters, edge_covered, the skin. Clusters are compared as sets with their numbers, the
// skin as triangles between vertices that are named by (owner, direction), each up to rotation; all else entry by
// entry. Requires two well-formed states of one body.
std::optional<DecisionDifference> difference_of_decisions(const State& expected, const State& actual,
                                                          Sets sets = Sets::compared);

// --- What is computed ------------------------------------------------------------------------------------------------

// Distances of positions [h], and differences of velocities [h/dt], of the particles in `mask` [n].
ErrorNorm position_error(const Setup& setup, const std::vector<Vec3>& expected, const std::vector<Vec3>& actual,
                         const std::vector<uint8_t>& mask);
ErrorNorm velocity_error(const Setup& setup, const std::vector<Vec3>& expected, const std::vector<Vec3>& actual,
                         double dt, const std::vector<uint8_t>& mask);

struct FieldError {
  std::string_view field;  // Field::name
  std::string_view unit;   // of `norm`
  ErrorNorm norm;          // `where`: particle, cluster, or the owner of a skin vertex
};
// For each field that is no decision, in the order of model/fields.h: points [h], velocities [h/dt], masses relative to
// `expected`, angles of rotations [rad], flags that differ [1], momenta [kg m/s]. Of particles those in `mask` [n]. The
// norm of a field is empty where its entries have no counterpart, because clusters or skin differ as decisions.
// Requires two well-formed states of one body; dt > 0 [s].
std::vector<FieldError> errors_of_fields(const Setup& setup, const State& expected, const State& actual, double dt,
                                         const std::vector<uint8_t>& mask);
// Throws std::invalid_argument if there is no such field.
const ErrorNorm& error_of(const std::vector<FieldError>& errors, std::string_view field);

// The angle of the rotation from a to b [rad], by ‖R − R'‖² = 8 sin²(angle / 2): exact for small angles, where the
// trace loses all digits. Not a number if an entry is none.
double angle_between(const Mat3& a, const Mat3& b);

}  // namespace cutproof::oracles
