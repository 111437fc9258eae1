#include "property_tests/histories.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "model/error.h"
#include "model/fields.h"
#include "model/io/limits.h"
#include "model/io/recording.h"
#include "model/io/unfinished.h"
#include "model/rules.h"
#include "oracles/comparison/state_difference.h"
#include "oracles/oracles.h"

namespace cutproof::property_tests {
namespace {

Stage stage_at(int32_t index) { return kStages[at(index % 6)]; }

// The last stage that ran, as recordings name it.
Stage before(Stage next) { return stage_at(static_cast<int32_t>(next) + 5); }

// The first entry of a field in which anything but the kicked component differs between two runs through a step and a
// detection; -1: none. Fields that neither stage may change must be equal as a whole. Of the rest particles and
// clusters go by their component, lists are compared without its particles, and a sum over the body holds the kick
// itself.
template <class T>
int64_t first_ghost(const Field& field, const T& still, const T& pushed, const Clusters& clusters,
                    const std::vector<int32_t>& component_of, int32_t kicked) {
  if (same_bits(still, pushed)) return -1;
  const bool moves = field.changed_by.contains(Stage::step) || field.changed_by.contains(Stage::detect);
  const auto is_kicked = [&](int32_t particle) {
    return particle >= 0 && at(particle) < component_of.size() && component_of[at(particle)] == kicked;
  };
  if constexpr (!requires { still.size(); }) {
    return moves && field.quantity == Quantity::momentum ? -1 : 0;
  } else {
    if constexpr (std::is_same_v<T, std::vector<int32_t>>) {
      if (moves && field.space == IndexSpace::state) {
        T others[2] = {still, pushed};
        for (T& list : others) std::erase_if(list, is_kicked);
        const auto [a, b] = std::mismatch(others[0].begin(), others[0].end(), others[1].begin(), others[1].end());
        return a == others[0].end() && b == others[1].end() ? -1 : a - others[0].begin();
      }
    }
    const auto count = static_cast<int64_t>(std::min(still.size(), pushed.size()));
    for (int64_t i = 0; i < count; ++i) {
      const bool of_particle = field.space == IndexSpace::particle, of_cluster = field.space == IndexSpace::cluster;
      const int32_t particle = of_particle  ? static_cast<int32_t>(i)
                               : of_cluster ? clusters.members[at(clusters.offsets[at(i)])]
                                            : -1;
      if (!(moves && is_kicked(particle)) && !same_bits(still[at(i)], pushed[at(i)])) return i;
    }
    return still.size() == pushed.size() ? -1 : count;
  }
}

std::string new_folder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "cutproof_history_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw MachineError(pattern + ": The folder cannot be made.");
  return pattern;
}

}  // namespace

// --- Commands -----------------------------------------------------------------------------------------------------

Position after(Position at, const Command& command) {
  if (const RunStages* run = std::get_if<RunStages>(&command)) {
    const int32_t index = static_cast<int32_t>(at.next) + run->stages;
    return {at.frame + index / 6, stage_at(index)};
  }
  return at;
}

namespace {

nlohmann::json json_of(const RunStages& run) { return {{"run", run.stages}, {"whole", run.whole}}; }
// Strokes are written and read as parts of a case, whose reader knows their fields.
nlohmann::json json_of(const Cut& cut) {
  Case c;
  c.strokes = {cut.stroke};
  return {{"cut", nlohmann::json::parse(to_json(c)).at("strokes").at(0)}};
}
nlohmann::json json_of(const Kick& kick) { return {{"kick", kick.component}, {"velocity", kick.velocity}}; }
nlohmann::json json_of(const SaveAndLoad& load) { return {{"save_and_load", load.through_files ? "files" : "memory"}}; }

Command command_of(const nlohmann::json& given) {
  Command command;
  if (given.contains("run")) {
    command = RunStages{given.at("run").get<int32_t>(), given.at("whole").get<bool>()};
  } else if (given.contains("cut")) {
    auto document = nlohmann::json::parse(to_json(Case{}));
    document["strokes"] = {given.at("cut")};
    command = Cut{from_json(document.dump()).strokes.at(0)};
  } else if (given.contains("kick")) {
    command = Kick{given.at("kick").get<int32_t>(), given.at("velocity").get<Quarters>()};
  } else {
    command = SaveAndLoad{given.at("save_and_load").get<std::string>() == "files"};
  }
  if (nlohmann::json::parse(to_json(command)) != given) {
    throw std::invalid_argument("commands: " + given.dump().substr(0, 60) + " is not known");
  }
  return command;
}

}  // namespace

std::string to_json(const Command& command) {
  return std::visit([](const auto& one) { return json_of(one).dump(); }, command);
}

std::vector<Command> commands_from_json(const std::string& list) {
  constexpr int32_t kMost = 1000;  // stages of a run, quarters of a velocity; no generator asks for more
  std::vector<Command> commands;
  try {
    const auto document = nlohmann::json::parse(list);
    if (document.size() > io::kMostCommands) {
      throw std::invalid_argument("commands must be " + std::to_string(io::kMostCommands) + " at most");
    }
    for (const auto& given : document) commands.push_back(command_of(given));
  } catch (const nlohmann::json::exception& error) {
    throw std::invalid_argument(std::string("commands: ") + error.what());
  }
  const auto is_fast = [](int32_t q) { return std::abs(q) > kMost; };
  for (const Command& command : commands) {
    const RunStages* run = std::get_if<RunStages>(&command);
    const Kick* kick = std::get_if<Kick>(&command);
    if (run && (run->stages < 1 || run->stages > kMost)) throw std::invalid_argument("run must be in [1, 1000]");
    if (kick && (kick->component < 0 || std::any_of(kick->velocity.begin(), kick->velocity.end(), is_fast))) {
      throw std::invalid_argument("kick must be >= 0, and velocity within 1000 quarters");
    }
  }
  return commands;
}

// --- History ------------------------------------------------------------------------------------------------------

History::History(Source make, Case c, bool keeps_moments)
    : make_(std::move(make)),
      case_(std::move(c)),
      loaded_(instance_of(case_)),
      staged_(make_()),
      state_(loaded_.state),
      keeps_moments_(keeps_moments) {
  if (case_.together != 1) throw std::invalid_argument("a history needs a case with one stroke a frame (together: 1)");
  if (promise_of(case_.merge).unique) whole_ = make_();
  given_strokes_ = static_cast<int32_t>(loaded_.setup.stroke_end.size());
  load_both(true);
  if (keeps_moments_) trace_.initial = std::make_shared<const State>(state_);
}

void History::execute(const Command& command) {
  if (failure_) return;
  const Position expected = after(position(), command);
  std::visit([this](const auto& one) { carry_out(one); }, command);
  if (!failure_ && !(position() == expected)) {
    fail(broken("a frame ends with skin and nowhere else", next_));
  }
}

void History::carry_out(const RunStages& command) {
  for (int32_t left = command.stages; left > 0 && !failure_;) {
    wait_for_frames(1);
    const int32_t first = static_cast<int32_t>(next_), count = std::min(left, 6 - first);
    run_span({next_, stage_at(first + count - 1)}, command.whole);
    left -= count;
  }
}

void History::run_span(Span span, bool whole) {
  const std::string name = staged_->name();
  const State start = state_;
  CaseRun run;
  run.trace.initial = std::make_shared<const State>(start);
  run.has_expanded = has_expanded_;
  staged_run_->run(span, [&](const harness::Moment& moment) {
    run.trace.moments.push_back(moment);
    if (keeps_moments_) trace_.moments.push_back(moment);
    const Clusters &before = moment.before->clusters, &after = moment.after->clusters;
    if (moment.span.contains(Stage::expand) && before.members != after.members) has_expanded_ = true;
  });
  const std::vector<Verdict> broken_contracts = staged_run_->take_broken_contracts();
  if (!broken_contracts.empty()) run.failure = broken_contracts.front();
  state_ = *staged_run_->states().front();
  next_ = stage_at(static_cast<int32_t>(span.last) + 1);

  Judgement judgement = judge_case(case_, loaded_, run, name, false);
  verdicts_ += judgement.verdicts;
  if (judgement.failure) return fail(std::move(*judgement.failure));

  const bool cuts = judgement.coverage["removal"] > 0;
  if (cuts && has_kicked_) ++coverage_["removal after a kick"];
  if (judgement.coverage["separation"] > 0) {
    const auto move = at(start.frame * loaded_.setup.step.substeps);
    if (loaded_.setup.blade_moves[move].stroke >= given_strokes_) ++coverage_["separation by a stroke that came later"];
  }
  if (!whole_) return;
  whole_run_->run(
      span, whole ? harness::Observer{} : [](const harness::Moment&) {});
  if (whole && whole_run_->ran() != staged_run_->ran()) {
    return fail(broken("a whole span runs the stages that are due", span.last));
  }
  require_same(whole ? "a span is the composition of its stages" : "same input, same bits", state_,
               *whole_run_->states().front());
  if (cuts && whole && span.last == Stage::skin) ++coverage_["cut in one span"];
  if (!state_.removed.empty() && unloaded_beside_ && span.last == Stage::skin) {
    ++coverage_["cut with and without a load"];
  }
}

// Each pause takes one frame.
void History::wait_for_frames(int64_t count) {
  const int64_t missing = count - (loaded_.setup.frame_count() - state_.frame);
  if (missing <= 0) return;
  Stroke pause;
  pause.down = false;
  if (!case_.strokes.empty()) pause.from = pause.to = resolved_strokes(case_).back().to;
  case_.strokes.insert(case_.strokes.end(), at(missing), pause);
  change_schedule();
}

void History::carry_out(const Cut& command) {
  case_.strokes.push_back(command.stroke);
  change_schedule();
}

void History::change_schedule() {
  loaded_.setup = setup_of(case_);
  load_both();
}

void History::carry_out(const Kick& command) {
  wait_for_frames(2);  // to observe the effect in the next one
  const Setup& setup = loaded_.setup;
  const oracles::Partition components = oracles::graph_components(setup, state_);
  if (components.count == 0 || failure_) return;
  const int32_t component = command.component % components.count;
  const double quarter = case_.spacing / 4, dt = setup.substep_length[at(state_.frame)];
  const auto [u, v, w] = command.velocity;
  State kicked = state_;
  for (std::size_t i = 0; i < kicked.v.size(); ++i) {
    if (components.label[i] == component) kicked.v[i] += Vec3{u * quarter / dt, v * quarter / dt, w * quarter / dt};
  }
  if (whole_ && components.count > 1) {
    require_no_ghost_force(kicked, components.label, component);
    ++coverage_["kick beside other components"];
  }
  has_kicked_ = true;
  state_ = std::move(kicked);
  load_both();
}

// Both bodies in one batch, so that neither may disturb the other. Stages until the next step do not see velocities;
// what that step moves may then be removed by the next detection. Later stages may differ: whether small clusters are
// merged depends on whether anything at all was removed.
void History::require_no_ghost_force(const State& kicked, const std::vector<int32_t>& component_of, int32_t component) {
  harness::FrameRunner run(*whole_, {loaded_.setup, loaded_.setup}, {state_, kicked});
  if (next_ != Stage::step) run.run({next_, Stage::skin}, nullptr);
  run.run({Stage::step, Stage::detect}, nullptr);
  const State &still = *run.states()[0], &pushed = *run.states()[1];
  ++verdicts_;
  for_each_field([&](const Field& field, auto get) {
    if (failure_) return;
    const int64_t index = first_ghost(field, get(still), get(pushed), still.clusters, component_of, component);
    if (index < 0) return;
    Verdict verdict = broken("no ghost force", Stage::step);
    verdict.bound_source = "oracles.md, Relations";
    if (field.space == IndexSpace::particle) verdict.witness.particles = {static_cast<int32_t>(index)};
    verdict.witness.text =
        std::string(field.text) + " differs when another component is kicked, entry " + std::to_string(index);
    fail(std::move(verdict));
  });
}

void History::carry_out(const SaveAndLoad& command) {
  note_load();
  State saved = staged_run_->snapshot().front();
  require_same("a snapshot changes nothing", state_, saved);
  Setup setup = loaded_.setup;
  if (command.through_files) {
    const io::Unfinished folder(new_folder());
    const std::string name = folder.path() + "/history";
    const io::RecordingPaths paths = io::recording_paths(name);
    const io::Unfinished index(paths.index), particles(paths.particles), skin(paths.skin), blade(paths.blade);
    io::Recorder recorder(name, setup, "{}", staged_->name());
    recorder.add(before(next_), saved);
    recorder.finish();
    const io::RecordingReader reader(name);
    io::Snapshot read = reader.snapshot(0);
    require_same("a recording gives back what was recorded", saved, read.state);
    saved = std::move(read.state);
    setup = reader.header().setup;
    if (!saved.skin.owner.empty()) ++coverage_["skin read from files"];
    staged_run_.reset();
    staged_ = make_();
  }
  loaded_.setup = setup;
  State taken = loaded_into(staged_run_, *staged_, saved);
  require_same("loading changes nothing", state_, taken, staged_->precision() != Precision::binary64);
  state_ = std::move(taken);
  unloaded_beside_ = whole_ && loads_in_bits();
  if (whole_ && !unloaded_beside_) {
    require_same("same input, same bits", state_, loaded_into(whole_run_, *whole_, saved));
  }
}

// A displacement of a single precision that is not zero may lose its last bits beside a rest position.
bool History::loads_in_bits() const {
  return staged_->precision() == Precision::binary64 || (!case_.moves && !has_kicked_);
}

State History::loaded_into(std::unique_ptr<harness::FrameRunner>& run, Backend& backend, const State& state) {
  run = std::make_unique<harness::FrameRunner>(backend, std::vector<Setup>{loaded_.setup}, std::vector<State>{state});
  return *run->states().front();
}

void History::load_both(bool is_first) {
  const bool is_single = staged_->precision() != Precision::binary64;
  State taken = loaded_into(staged_run_, *staged_, state_);
  // The first state was not made by this backend, so in single precision more than velocities is rounded.
  if (!is_first || !is_single) require_same("loading changes nothing", state_, taken, is_single);
  if (is_single)
    require_same("loading what is rounded changes nothing", taken, loaded_into(staged_run_, *staged_, taken));
  if (whole_) require_same("same input, same bits", taken, loaded_into(whole_run_, *whole_, taken));
  state_ = std::move(taken);
  unloaded_beside_ = false;
}

void History::require_same(const char* property, const State& expected, const State& found, bool but_for_rounding) {
  ++verdicts_;
  const auto difference = oracles::first_difference_in_bits(expected, found, but_for_rounding);
  if (!difference) return;
  Verdict verdict = broken(property, before(next_));
  verdict.measured = 1;
  verdict.witness.text = std::string(difference->text) + " differs, entry " + std::to_string(difference->index);
  fail(std::move(verdict));
}

Verdict History::broken(const char* what, Stage stage) const {
  Verdict verdict = harness::broken_contract(what, stage, state_.frame);
  verdict.backend = staged_->name();
  return verdict;
}

void History::fail(Verdict verdict) {
  if (!failure_) failure_ = std::move(verdict);
}

void History::note_load() {
  if (next_ > Stage::detect && state_.removed.empty()) return;
  ++coverage_[next_ == Stage::step ? "load between frames" : "load before " + std::string(name_of(next_))];
  if (next_ > Stage::detect && !state_.debris.empty()) ++coverage_["load with debris"];
}

History history_of(History::Source make, const Case& c, const std::vector<Command>& commands) {
  History history(std::move(make), c);
  for (const Command& command : commands) history.execute(command);
  return history;
}

}  // namespace cutproof::property_tests
