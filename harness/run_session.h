// A run of a scene and all that observes it: the judge, relations in a sample of frames, the comparison with the
// reference, errors, recordings.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/against.h"
#include "harness/errors.h"
#include "harness/frame_runner.h"
#include "harness/relation_sample.h"
#include "harness/scene_judge.h"
#include "model/backend.h"
#include "model/io/recording.h"
#include "model/stop.h"

namespace cutproof::harness {

// Observers of a run; empty ones are absent.
struct Observers {
  std::optional<Depth> judge = {};
  std::optional<AgainstMode> against = {};
  std::optional<ErrorsWanted> errors = {};
  std::string record = {};  // name of a recording
  std::string page = {};  // name of a page that shows the run, and beside `against` the reference's: both are recorded
};

// A setup, the initial state, and further data on both. They must outlive the session.
struct RunInput {
  const Setup& setup;
  const State& start;
  const Expectations& expect;
  std::string backend;                       // its name
  std::string scene_json;                    // kept in recordings
  std::optional<int64_t> cut_short_at = {};  // frame at which the run stops before the scene does
  std::vector<std::string> notes = {};       // for the reader of the verdicts
};

// Owns the observers and the order in which they see the run. However the program ends, no incomplete and no
// unrequested recording stays. A recording that only a page needs has no name once it can be read.
class RunSession {
 public:
  // `make` gives more backends of the kind of `backend`, which must outlive this. Throws what io::Recorder throws, so
  // that a folder that cannot be written to is known before anything runs.
  RunSession(RunInput input, Observers wanted, Backend& backend, oracles::MakeBackend make);

  // Runs all frames, or those until a stop is asked; calls `on_frame` at the end of each. In a stopped run, errors that
  // need further runs are not measured. Throws InputError for a comparison with a backend that runs several stages in
  // one piece.
  void run(const std::function<void(const FrameResult&)>& on_frame, const StopAsked& stop_asked = {});
  bool is_stopped() const { return is_stopped_; }

  // The rest is complete after run(). Null: not requested.
  const std::vector<FrameResult>& frames() const { return frames_; }
  const SceneJudge* judge() const { return judge_ ? &*judge_ : nullptr; }
  const Against* against() const { return against_ ? &*against_ : nullptr; }
  const Errors* errors() const { return errors_ ? &*errors_ : nullptr; }
  const io::RecordingReader* recording() const { return recording_.get(); }  // for the page
  const io::RecordingReader* reference_recording() const { return reference_recording_.get(); }
  // Violations of the backend's contract; the judge has them too.
  const std::vector<Verdict>& broken_contracts() const { return broken_; }
  // Observed stages that the backend cannot run.
  std::vector<std::string> left_to_reference() const { return stages_.left(); }
  // Whether all verdicts, comparisons and measurements hold.
  bool holds() const;

 private:
  void begin(const Snapshot& loaded);
  void see(const Moment& moment, bool launched);
  void take_relations();
  void compare(const Moment& moment, bool launched);
  void finish(const Snapshot& end);

  RunInput input_;
  Observers wanted_;
  Backend& backend_;
  oracles::MakeBackend make_;
  std::string record_, reference_record_;
  std::optional<io::Recorder> recorder_, reference_recorder_;
  std::optional<SceneJudge> judge_;
  std::optional<RelationSample> relations_;
  std::optional<Against> against_;
  std::optional<Errors> errors_;
  StagesRun stages_;
  // The last state is recorded as the next moment begins: the backend may have rounded what it was handed.
  std::optional<std::pair<Stage, Snapshot>> not_recorded_;
  std::vector<FrameResult> frames_;
  bool is_stopped_ = false;
  std::vector<Verdict> broken_;
  std::unique_ptr<io::RecordingReader> recording_, reference_recording_;
};

}  // namespace cutproof::harness
