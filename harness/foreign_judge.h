// Judges one state of another simulator by the registry of properties. A property is named as not judged if the file
// lacks its arrays, if it is not promised, or if a single state cannot show it.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "harness/foreign_state.h"
#include "model/verdict.h"

namespace cutproof::harness {

struct NotJudged {
  std::string property, why;
};

struct ForeignVerdicts {
  std::vector<Verdict> verdicts;
  std::vector<NotJudged> not_judged;  // in the order of the registry
  std::vector<std::string> notes;     // notes for the reader of the verdicts, one sentence each
  // The number of pieces of living tissue, and in words; empty for a state that is not well formed.
  std::optional<int64_t> pieces;
  std::string pieces_in_words;
  int64_t coincident = 0;  // living particles that rest where another one does

  // Also false if nothing but the form of the state was judged.
  bool holds() const;
};

// "skin surface" of a skin whose vertices have no owners: closed, oriented, 2-manifold, and not empty if there is
// tissue.
Verdict closed_skin(const Skin& skin, bool any_alive);

ForeignVerdicts judge_foreign_state(const ForeignState& foreign);

}  // namespace cutproof::harness
