// A history: one random body and a sequence of commands. Between any two stages it may be saved and loaded, kicked, or
// get another stroke; all promises of the backend must still hold (architecture.md, Properties).
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "harness/frame_runner.h"
#include "property_tests/dissection.h"

namespace cutproof::property_tests {

// The next `stages` stages in order, beyond the end of a frame into the next one. Where the schedule is over, the
// blade stays up for a frame.
struct RunStages {
  int32_t stages = 1;
  bool whole = false;  // as one span for each frame, not stage by stage
  friend bool operator==(const RunStages&, const RunStages&) = default;
};
// One more stroke, after those that are still to come.
struct Cut {
  Stroke stroke;
  friend bool operator==(const Cut&, const Cut&) = default;
};
// All of one component of the tissue gets a velocity on top of its own.
struct Kick {
  int32_t component = 0;          // modulo the number of components
  Quarters velocity = {0, 0, 0};  // [quarters per substep]
  friend bool operator==(const Kick&, const Kick&) = default;
};
// To be gone on with by the same backend, or through a recording's files by another of its kind.
struct SaveAndLoad {
  bool through_files = false;
  friend bool operator==(const SaveAndLoad&, const SaveAndLoad&) = default;
};
using Command = std::variant<RunStages, Cut, Kick, SaveAndLoad>;

// One line of JSON, for people and for files. commands_from_json throws std::invalid_argument for anything else.
std::string to_json(const Command& command);
std::vector<Command> commands_from_json(const std::string& list);

// The state of a history that decides which command may come next.
struct Position {
  int64_t frame = 0;
  Stage next = Stage::step;
  friend bool operator==(const Position&, const Position&) = default;
};
Position after(Position at, const Command& command);

// Coverage classes of histories.
inline constexpr std::array<const char*, 13> kHistoryClassNames = {
    "load between frames",
    "load before detect",
    "load before split",  // this and the following ones: in a frame that has removed particles
    "load before merge",
    "load before expand",
    "load before skin",
    "load with debris",  // of the frame in progress
    "skin read from files",
    "cut in one span",              // detection to the end of the frame, and something was removed
    "cut with and without a load",  // by an unloaded backend beside a loaded one, to the end of a frame
    "kick beside other components",
    "removal after a kick",
    "separation by a stroke that came later",
};
using HistoryCoverage = Coverage<kHistoryClassNames>;

// Runs a history and judges it. After every stage: all oracles, and the reference's answer to the same state
// (judge_case). Beyond these:
// - Loading changes nothing: the state comes back with the same bits, in single precision the impulse (a sum over
//   particles there) up to rounding. In double precision, and in single as long as nothing has moved, a backend that is
//   saved and loaded also goes on with the same bits as one beside it that is not. A state has positions and kernels
//   have displacements, of which those below 2⁻²⁹ of a position lose bits in it; so where they move, both are loaded.
// - Spans that run whole give the same bits as their stages, which another backend runs one by one.
// - A kick of one component leaves the bits of all others alone, until all stages that see velocities have run.
// Where a merge rule lets a schedule decide (`published`), equal bits are not asked for.
class History {
 public:
  using Source = std::function<std::unique_ptr<Backend>()>;
  // Loads the case. Requires one stroke a frame (Case::together): a stroke that is added later takes a frame of its
  // own. `keeps_moments`: for pages. Throws std::invalid_argument.
  History(Source make, Case c, bool keeps_moments = false);

  // Does nothing once there is a failure. Throws what backends throw.
  void execute(const Command& command);
  Position position() const { return {state_.frame, next_}; }

  const std::optional<Verdict>& failure() const { return failure_; }
  const HistoryCoverage& coverage() const { return coverage_; }
  int64_t verdicts() const { return verdicts_; }
  // Of the backend that is judged, from its first load to where it is, over kicks and loads, which make no moments of
  // their own; empty unless they are kept. The setup is that of the last command: strokes that came later leave the
  // frames before them as they were.
  const harness::Trace& trace() const { return trace_; }
  const Setup& setup() const { return loaded_.setup; }

 private:
  void carry_out(const RunStages& command);
  void carry_out(const Cut& command);
  void carry_out(const Kick& command);
  void carry_out(const SaveAndLoad& command);

  void run_span(Span span, bool whole);
  void wait_for_frames(int64_t count);
  void change_schedule();
  void load_both(bool is_first = false);
  State loaded_into(std::unique_ptr<harness::FrameRunner>& run, Backend& backend, const State& state);
  void require_same(const char* property, const State& expected, const State& found, bool but_for_rounding = false);
  void require_no_ghost_force(const State& kicked, const std::vector<int32_t>& component_of, int32_t component);
  bool loads_in_bits() const;
  Verdict broken(const char* what, Stage stage) const;
  void fail(Verdict verdict);
  void note_load();

  Source make_;
  Case case_;  // the strokes of the history's own are appended
  Instance loaded_;
  std::unique_ptr<Backend> staged_;  // runs stage by stage, is judged, saved and loaded
  std::unique_ptr<Backend> whole_;   // beside it; null if equal bits are not asked for
  std::unique_ptr<harness::FrameRunner> staged_run_, whole_run_;
  State state_;  // of staged_
  Stage next_ = Stage::step;
  int32_t given_strokes_ = 0;  // with the blade down, of the case as drawn
  bool has_expanded_ = false;
  bool has_kicked_ = false;
  bool unloaded_beside_ = false;  // whole_ went on as it was when staged_ was last loaded
  std::optional<Verdict> failure_;
  HistoryCoverage coverage_;
  int64_t verdicts_ = 0;
  bool keeps_moments_ = false;
  harness::Trace trace_;
};

// A whole history: all of its commands, unless one fails before. Throws what backends throw.
History history_of(History::Source make, const Case& c, const std::vector<Command>& commands);

}  // namespace cutproof::property_tests
