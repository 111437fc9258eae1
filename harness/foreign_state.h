// One state of another simulator, from named arrays (docs/reference/state.md).
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
  // The reason why the values of readable arrays are not a State, or "".
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
  std::vector<std::string> notes;  // on ignored or converted arrays
};

// Arrays that a file may contain. Texts: `promises` and `weights`.
const std::vector<KnownArray>& foreign_state_arrays();
const std::vector<KnownArray>& foreign_state_texts();

// A wrong shape, type or name makes the file unreadable: InputError. A wrong value (an index out of range, offsets that
// descend) makes the state not well formed: a verdict. The exceptions are single numbers (spacing, tau, cap, alpha),
// which are parameters of the judgement, and a `rest` that contradicts the grid: InputError.
//
// Members and `removed` are sorted, clusters are put into the order of their numbers, and each edge is listed at both
// ends, so files need none of this.
ForeignState foreign_state_of(const io::ArrayFile& contents, const std::string& file);

}  // namespace cutproof::harness
