// The judge of a run: checks every applicable property at each moment of one body. All runs, live or recorded, scene or
// random case, are judged here.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/depth.h"
#include "harness/moments.h"
#include "harness/promises.h"
#include "model/verdict.h"
#include "oracles/oracles.h"

namespace cutproof::harness {

enum class Thorough {
  never,
  when_cut,  // the first skin, and after every cut
  always
};

class Judge {
 public:
  // `setup` must outlive this. `backend` is the name in verdicts. The default depth judges every property.
  Judge(const Setup& setup, std::string backend, Promises promises, Thorough thorough, Depth depth = Depth::motion);
  ~Judge();

  // The state as loaded. `has_expanded`: an expansion may have changed its clusters already.
  void begin(const Snapshot& initial, bool has_expanded = false);
  // Moments in order. Stages that the reference ran for the backend are not judged.
  void see(const Moment& moment);
  // Adds another verdict on this run, such as a broken contract. A verdict that is not promised is left out.
  void add(Verdict verdict);

  const std::vector<Verdict>& verdicts() const { return verdicts_; }
  std::vector<Verdict> take_verdicts();

  // States of which a property was not promised, and in how many of them it did not hold.
  struct Unpromised {
    std::string property;
    int64_t states = 0, failing = 0;
  };
  const std::vector<Unpromised>& unpromised() const { return unpromised_; }
  bool has_expanded() const { return has_expanded_; }
  int64_t frame() const { return frame_; }  // in progress
  bool is_lost() const { return lost_; }    // the last state is not well formed, or of another frame

  // For reports: counts of the last state seen, from known results; 0 if that state is not well formed.
  int32_t component_count();
  int32_t inner_shells();

 private:
  // `known_rotations`: as oracles::StageRun has it.
  void see_stage(Stage stage, const State& before, const State& after,
                 std::span<const oracles::RotationKnown> known_rotations = {});
  void see_several(const Moment& moment, const std::array<bool, 6>& due);
  void take(std::vector<Verdict> found, Stage stage, const State& state);
  void leave_out(const Verdict& verdict);
  bool is_promised(const Verdict& verdict, Stage stage, const State& state) const;

  const Setup& setup_;
  std::string backend_;
  Promises promises_;
  Thorough thorough_;
  oracles::Judge judge_;
  std::vector<Verdict> verdicts_;
  std::vector<Unpromised> unpromised_;
  std::vector<Snapshot> kept_;  // input of judge_
  Snapshot last_;
  int64_t frame_ = 0;
  bool has_expanded_ = false;
  bool skin_judged_ = false;  // the present triangles have been judged thoroughly
  bool lost_ = false;         // the last state is not well formed, so the next one cannot be compared with it
};

// For a span that begins with step and shows only its end: the fields after step that no later stage may change. The
// other fields are those of the state before.
State after_step(const State& before, const State& end);

}  // namespace cutproof::harness
