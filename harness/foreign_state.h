// One state that somebody else's simulator wrote, from named arrays (docs/reference/state.md).
#pragma once
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "harness/named_arrays.h"
#include "harness/promises.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::harness {

struct ForeignState {
  Setup setup;  // of the body alone: no schedule, no contacts, no rules of its own
  State state;
  // Why no State could be made of the values, or "": the arrays could be read, and what they say is not a state.
  std::string defect;
  std::set<std::string, std::less<>> given;  // names of the arrays that are there
  Promises promises;
  bool promises_given = false;  // else all that the arrays allow
  // A surface without owners, which is no Skin of a state. Empty if `vertices` is not there or owners are.
  Skin loose_skin;
  double extent = 0;  // L: the greatest distance of a living or resting place from the origin of the file [m]
  // m_i in each cluster that holds particle i, instead of m_i / n_i. Then the masses of `setup` are n_i m_i, which
  // share out to that.
  bool plain_weights = false;
  std::optional<int64_t> pieces;   // how many the tissue is said to be in
  std::vector<std::string> notes;  // on what was passed over, or read as something else
};

// What a file may hold. Of texts: `promises` and `weights`.
const std::vector<KnownArray>& foreign_state_arrays();
const std::vector<KnownArray>& foreign_state_texts();

// Shapes, types and names are the file's: where one is wrong the file cannot be understood, and an InputError says so.
// Values are the state's: where one is wrong (an index out of range, offsets that descend) the state is not well
// formed, and the judge says so. The exceptions are single numbers (spacing, tau, cap, alpha), which ask a question of
// the state, and a `rest` that contradicts the grid: InputError.
//
// Members are sorted, `removed` is, clusters are put into the order of their numbers, and each edge is put at both of
// its ends, so that none of that is demanded.
ForeignState foreign_state_of(const io::ArrayFile& contents, const std::string& file);

}  // namespace cutproof::harness
