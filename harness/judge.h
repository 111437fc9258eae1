// The gate: puts every oracle that applies to the snapshots of one body, in order, and holds the outcome against what
// the scene expects. `run --check` and `check` feed it the same snapshots, so they give the same verdicts.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "model/scene.h"
#include "model/state.h"
#include "model/verdict.h"

namespace cutproof::cli {

class Gate {
 public:
  // `initial` is the state as loaded.
  Gate(const Setup& setup, const Expectations& expectations, std::string backend, const State& initial);

  // One snapshot of a frame: after a stage from detect on in frames that removed something, and after the last stage
  // of every frame, which is passed as Stage::skin.
  void see(Stage stage, const State& state);

  // After the last snapshot: the scene's expectations as verdicts.
  void finish();

  const std::vector<Verdict>& verdicts() const { return verdicts_; }
  bool holds() const;
  // A failure that the scene expects: its `expect.isolated_clusters` asks for at least one.
  bool expected_failure(const Verdict& verdict) const;

 private:
  void add(std::vector<Verdict> found, Stage stage, int64_t frame);
  void note_progress(const State& state, int64_t frame);
  void expect(const std::string& what, double measured, double low, double high, const std::string& unit,
              const std::string& text);

  const Setup& setup_;
  Expectations expectations_;
  std::string backend_;
  std::vector<Verdict> verdicts_;
  State previous_;            // the last snapshot
  State frame_start_;         // the state when the present frame began
  int64_t frame_ = 0;         // the frame in progress
  bool frame_begun_ = false;  // a snapshot of the frame in progress has been seen
  bool skin_judged_ = false;  // the present triangles have been judged thoroughly
  // What the expectations are held against.
  int64_t initial_clusters_ = 0;
  int64_t removed_ = 0;
  double dent_ = 0;
  double greatest_stretch_ = 0;
  double isolated_ = 0;
  std::vector<int64_t> components_after_stroke_;
};

}  // namespace cutproof::cli
