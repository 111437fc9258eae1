// Judges one state that somebody else's simulator wrote, by the registry of properties. What the file leaves out, what
// its author does not promise and what a single state cannot show is not judged, and is named.
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
  std::vector<std::string> notes;     // what a reader of the verdicts has to know, one sentence each
  // How many pieces the living tissue is in, and in words; nothing of a state that is not well formed.
  std::optional<int64_t> pieces;
  std::string pieces_in_words;
  int64_t coincident = 0;  // living particles that rest where another one does

  // Also false if nothing but the form of the state was judged.
  bool holds() const;
};

// "skin surface" of a skin whose vertices have no owners: closed, oriented, 2-manifold; and there, if any tissue is.
Verdict closed_skin(const Skin& skin, bool any_alive);

ForeignVerdicts judge_foreign_state(const ForeignState& foreign);

}  // namespace cutproof::harness
