// Compares a run with its scene's expectations (model/scene.h, Expectations).
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/moments.h"
#include "model/scene.h"
#include "model/verdict.h"

namespace cutproof::harness {

// The part of its scene that a run has reached.
enum class Extent {
  whole,
  cut_short  // it was asked to stop before the scene's end
};

class ExpectationCheck {
 public:
  // `setup` must outlive this. `initial` is the state as loaded.
  ExpectationCheck(const Setup& setup, const Expectations& expectations, const Snapshot& initial,
                   Extent extent = Extent::whole);

  // It turns out that the run is cut short.
  void cut_short() { extent_ = Extent::cut_short; }
  // Every moment; only the ends of frames are looked at, and of them only those that are well formed.
  void see(const Moment& moment);

  struct Judged {
    // One verdict for each expectation, with the stage and frame of its failure: the first frame with too much, or the
    // last frame if there was too little. A run that ends early has verdicts only where the outcome is certain:
    // complete strokes, final values, and exceeded limits.
    std::vector<Verdict> verdicts;
    // The other expectations, which such a run has not reached.
    std::vector<std::string> not_reached;
    // Expectations that depend only on stages that the reference ran for the backend: not judged.
    std::vector<std::string> not_its_own;
  };
  // After the last moment. `stages`: which of them the backend ran.
  Judged judged(const StagesRun& stages) const;

  // Whether the scene expects anything at all.
  bool any() const;
  // A failure that the scene expects: tissue that is connected and not coupled, where its `expect.isolated_clusters`
  // asks for at least one group of it. Nothing else is excused.
  bool is_expected_failure(const Verdict& verdict) const;

 private:
  // Something that is counted in every frame, and never falls.
  struct Greatest {
    double value = 0;
    std::optional<int64_t> beyond;  // the first frame in which it was more than is expected
    void see(double now, int64_t frame, const std::optional<Range>& expected);
  };
  int64_t last_frame() const { return frames_seen_ > 0 ? frames_seen_ - 1 : 0; }

  const Setup& setup_;
  Expectations expectations_;
  Extent extent_;
  Snapshot last_;  // end of the last frame that is well formed
  int64_t initial_clusters_ = 0;
  int64_t frames_seen_ = 0;
  Greatest removed_, isolated_;
  Greatest dent_, greatest_stretch_;  // [h]
  int32_t components_ = 0;            // in the last frame in which they were counted
  int64_t components_since_ = 0;      // the first frame from which on there are so many
  struct AfterStroke {
    int64_t count = 0;
    std::string pieces;  // in words
  };
  std::vector<std::optional<AfterStroke>> after_stroke_;
};

}  // namespace cutproof::harness
