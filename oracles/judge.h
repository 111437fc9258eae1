// Judges states and stages by lists of properties.
#pragma once
#include <memory>
#include <vector>

#include "oracles/registry.h"

namespace cutproof::oracles {

// For states of one body that follow one another. A verdict that held is repeated and not computed again as long as
// every part of the state that it rests on keeps its bits; so is what verdicts are derived from, and that a cluster is
// connected as long as its members and their being alive stay the same.
class Judge {
 public:
  // Keeps references: setup and lists must outlive this, unchanged. `lists` begin with core_properties(). There is no
  // default, so that a caller names all properties that it judges by.
  Judge(const Setup& setup, PropertyLists lists);
  ~Judge();
  // All properties of a state in which `after` was the last stage and that are due then; thorough ones only if wanted.
  // The last state that was given must stay as it is, and where it is, until another was given.
  std::vector<Verdict> state(const State& state, Stage after, bool thorough);
  // All properties of the stage, and those of the state after it that are this stage's promise.
  // `known_rotations`: as StageRun has it.
  std::vector<Verdict> stage(Stage stage, const State& before, const State& after,
                             std::span<const RotationKnown> known_rotations = {});

  // For reports. Components of G, and shells of the skin whose volume at `position` is not positive, triangles joined
  // at their vertices; 0 if the state is not well formed.
  int32_t component_count(const State& state);
  int32_t inner_shells(const State& state);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

// One state or one stage by a judge that has seen nothing before. Without `after`: at the end of a frame.
std::vector<Verdict> judge(const Setup& setup, const State& state, Stage after, bool thorough,
                           const PropertyLists& lists);
std::vector<Verdict> judge(const Setup& setup, const State& state, bool thorough, const PropertyLists& lists);
std::vector<Verdict> judge_stage(const Setup& setup, Stage stage, const State& before, const State& after,
                                 const PropertyLists& lists);

}  // namespace cutproof::oracles
