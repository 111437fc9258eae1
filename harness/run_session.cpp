#include "harness/run_session.h"

#include <algorithm>

#include "harness/backends.h"
#include "model/error.h"
#include "model/io/unfinished.h"

namespace cutproof::harness {

namespace {

// The reader keeps its files open, and open files persist without a name.
std::unique_ptr<io::RecordingReader> read_and_remove(const std::string& recording) {
  const io::RecordingPaths paths = io::recording_paths(recording);
  const io::Unfinished index(paths.index), particles(paths.particles), skin(paths.skin), blade(paths.blade);
  return std::make_unique<io::RecordingReader>(recording);
}

}  // namespace

RunSession::RunSession(RunInput input, Observers wanted, Backend& backend, oracles::MakeBackend make)
    : input_(std::move(input)), wanted_(std::move(wanted)), backend_(backend), make_(std::move(make)) {
  const bool is_passing = wanted_.record.empty() && !wanted_.page.empty();
  record_ = is_passing ? io::unfinished_name(wanted_.page) : wanted_.record;
  if (record_.empty()) return;
  recorder_.emplace(record_, input_.setup, input_.scene_json, input_.backend, harness::left_to_reference(backend_),
                    input_.cut_short_at, backend_.promises());
}

void RunSession::run(const std::function<void(const FrameResult&)>& on_frame, const StopAsked& stop_asked) {
  FrameRunner runner(backend_, {input_.setup}, {input_.start});
  const auto state = [&]() -> const Snapshot& { return runner.states().front(); };
  begin(state());
  Observer observer;
  if (judge_ || recorder_ || against_) {
    observer = [&](const Moment& moment) { see(moment, runner.ran()[static_cast<std::size_t>(moment.span.last)]); };
  }
  while (!runner.is_over() && !is_asked(stop_asked)) {
    const bool is_measured = errors_ && errors_->wants(state()->frame);
    if (is_measured) errors_->frame_begins(*state());
    frames_.push_back(runner.run_frame(observer));
    if (is_measured) errors_->frame_ends(*state());
    on_frame(frames_.back());
  }
  is_stopped_ = !runner.is_over();
  broken_ = runner.take_broken_contracts();
  finish(state());
}

void RunSession::begin(const Snapshot& loaded) {
  const Setup& setup = input_.setup;
  if (wanted_.judge) {
    Promises promises;
    promises.words = parse_promises(backend_.promises(), input_.backend, "promises");
    judge_.emplace(setup, input_.expect, input_.backend, loaded, *wanted_.judge, promises,
                   input_.cut_short_at ? Extent::cut_short : Extent::whole);
  }
  if (wanted_.judge == Depth::motion) relations_.emplace(setup, make_());
  if (wanted_.against) against_.emplace(setup, input_.start, *loaded, input_.backend, *wanted_.against);
  if (wanted_.errors) errors_.emplace(*wanted_.errors, setup, *loaded, make_);
  if (recorder_) recorder_->add(Stage::skin, *loaded);
  if (!against_ || wanted_.page.empty()) return;
  // The reference's states, so that the page can show the distance.
  reference_record_ = io::unfinished_name(wanted_.page);
  reference_recorder_.emplace(reference_record_, setup, "", std::string(reference_backend().name));
  // The reference computes in double precision, whatever it was handed.
  const auto add = [this](Stage stage, State after) {
    after.precision = Precision::binary64;
    reference_recorder_->add(stage, after);
  };
  add(Stage::skin, input_.start);
  against_->observe_reference(add);
}

void RunSession::take_relations() {
  for (Verdict& verdict : relations_->take_verdicts()) judge_->add(std::move(verdict));
}

void RunSession::see(const Moment& moment, bool launched) {
  stages_.see(input_.setup, moment);
  if (judge_) judge_->see(moment);
  if (relations_) {
    relations_->see(moment);
    take_relations();
  }
  if (recorder_ && not_recorded_) recorder_->add(not_recorded_->first, *moment.before);
  not_recorded_.emplace(moment.span.last, moment.after);
  if (against_) compare(moment, launched);
}

// The comparison goes stage by stage.
void RunSession::compare(const Moment& moment, bool launched) {
  const auto due = due_stages(input_.setup, *moment.before, moment.span, *moment.after);
  if (std::count(due.begin(), due.end(), true) > 1) {
    throw InputError("command line", "--against", "this backend runs several stages in one piece",
                     "choose one that runs them one by one, or leave --against out");
  }
  against_->see(moment.span.last, *moment.after, launched, moment.by_backend);
}

void RunSession::finish(const Snapshot& end) {
  if (judge_) {
    if (relations_) {
      relations_->wait();
      take_relations();
    }
    for (const Verdict& verdict : broken_) judge_->add(verdict);
    if (relations_) {
      for (std::string& sentence : relations_->notes()) judge_->note(std::move(sentence));
    }
    for (std::string& sentence : input_.notes) judge_->note(std::move(sentence));
    if (is_stopped_) judge_->stop();
    judge_->finish();
  }
  if (errors_ && !is_stopped_) errors_->finish(*end);
  if (recorder_) {
    if (not_recorded_) recorder_->add(not_recorded_->first, *not_recorded_->second);
    recorder_->finish();
  }
  if (!wanted_.page.empty()) {
    recording_ = wanted_.record.empty() ? read_and_remove(record_) : std::make_unique<io::RecordingReader>(record_);
  }
  if (reference_recorder_) {
    reference_recorder_->finish();
    reference_recording_ = read_and_remove(reference_record_);
  }
}

bool RunSession::holds() const {
  return !is_stopped_ && broken_.empty() && (!judge_ || judge_->holds()) && (!against_ || against_->holds()) &&
         (!errors_ || errors_->holds());
}

}  // namespace cutproof::harness
