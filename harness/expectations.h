// What a scene expects of its run (model/scene.h, Expectations), held against the run.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/moments.h"
#include "model/scene.h"
#include "model/verdict.h"

namespace cutproof::harness {

class ExpectationCheck {
 public:
  // `setup` must outlive this. `initial` is the state as loaded.
  ExpectationCheck(const Setup& setup, const Expectations& expectations, const Snapshot& initial);

  // Every moment; only the ends of frames are looked at, and of them only those that are well formed.
  void see(const Moment& moment);

  // After the last moment: one verdict for each thing that is expected, stage and frame filled in.
  std::vector<Verdict> verdicts() const;

  // Whether the scene expects anything at all.
  bool any() const;
  // A failure that the scene expects: tissue that is connected and not coupled, where its `expect.isolated_clusters`
  // asks for at least one group of it. Nothing else is excused.
  bool is_expected_failure(const Verdict& verdict) const;

 private:
  Verdict verdict(const std::string& what, double measured, double low, double high, const std::string& unit,
                  const std::string& text) const;

  const Setup& setup_;
  Expectations expectations_;
  Snapshot last_;  // end of the last frame that is well formed
  int64_t initial_clusters_ = 0;
  int64_t frames_seen_ = 0;
  int64_t removed_ = 0;
  double dent_ = 0;              // [h]
  double greatest_stretch_ = 0;  // [h]
  double isolated_ = 0;
  std::vector<std::optional<int64_t>> components_after_stroke_;
};

}  // namespace cutproof::harness
