// Shared code of the questions about split and merge: a body with its clusters in the middle of a frame. Internal to
// guests/.
#pragma once
#include <string>
#include <vector>

#include "guests/questions/kinds.h"
#include "model/stage.h"
#include "property_tests/cases.h"

namespace cutproof::guests {

extern const OperationDescription kSplit, kMerge;

struct Dissected {
  Tissue tissue;
  std::vector<std::vector<int32_t>> clusters;  // members ascending
  std::vector<int32_t> number;                 // ascending; empty: 0, 1, …
  int32_t debris = 0;                          // for a split
  int32_t tau = 0, cap = 0;                    // for a merge
};

// Those of the tissue, and `offsets`, `members`, `number`; the limits are added by who asks.
Arrays arrays_of(const Dissected& dissected);
// Their defect, or "": sizes, indices, and clusters that were not connected before the last cut.
std::string problem_of_dissected(const Question& question);

// The state before the stage, and a setup in which that stage is due. Each cluster's rotation identifies the cluster:
// its number is the first entry, if `rotations_are_told`, else all are equal.
struct BeforeStage {
  Setup setup;
  State state;
};
BeforeStage before_stage(const Question& question, bool rotations_are_told);
// The rotation of the cluster that has this number.
Mat3 rotation_named(int64_t number);
// The state with these clusters instead of its own: all sizes fit, whatever the arrays hold.
State with_clusters(State state, const Array& offsets, const Array& members, const Array& number);
// Of a state: `offsets`, `members`, `number`.
Arrays clusters_of(const State& state);

// Clusters of living particles: all within some steps from a centre, until every particle is covered.
std::vector<std::vector<int32_t>> balls(const Tissue& tissue, int32_t most_steps, Random& random);
// Clusters of a grid along x, each so many nodes wide, which begin every `step` nodes; of all particles.
std::vector<std::vector<int32_t>> slabs(const Tissue& tissue, int32_t width, int32_t step);
// Numbers that ascend with gaps.
std::vector<int32_t> numbers_with_gaps(std::size_t count, Random& random);
// A box of at most so many nodes along each axis.
Tissue draw_box(Random& random, int32_t most);

// A state of a small random dissection (property_tests/cases.h), run by the reference up to this stage of a frame in
// which something was cut.
Dissected draw_dissection(Random& random, Stage stage, property_tests::ClusterKind clusters);

}  // namespace cutproof::guests
