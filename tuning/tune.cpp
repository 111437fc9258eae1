#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "benchmarks/report.h"
#include "cli/commands.h"
#include "cli/json_number.h"
#include "harness/backends.h"
#include "harness/frame_runner.h"
#include "harness/scene_judge.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/scene_io.h"
#include "tuning/answer.h"
#include "tuning/search.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

// The answer is refined until this part of the tolerance is left for what is not known of it, if it can be.
constexpr double kUnknownShare = 0.25;

const char* name_of(Acceleration acceleration) { return acceleration == Acceleration::none ? "none" : "chebyshev"; }

// Methods that give no wrong answer to any hard case (docs/rotations.md). Another might be within the tolerance on this
// scene and fail on the next cut.
const std::vector<std::string>& sound_rotations() {
  static const std::vector<std::string> names = {"newton", "jacobi4", "svd"};
  return names;
}

// How far a backend goes from an answer, frame by frame.
class Comparison {
 public:
  // `allowed`: the RMS distance up to which a frame is within [h].
  Comparison(const Setup& setup, const Course& answer, double allowed)
      : setup_(setup), answer_(answer), allowed_(allowed) {}

  void add(const State& state) {
    const std::size_t f = course_.frames.size();
    course_.frames.push_back(oracles::pose_of(setup_, state, f == 0 ? nullptr : &course_.frames.back()));
    if (f >= answer_.frames.size()) return;
    const oracles::Apart apart = oracles::poses_apart(setup_, answer_.frames[f], course_.frames.back());
    rms_h_.push_back(apart.position.rms());
    if (!(rms_h_.back() <= allowed_) && !first_beyond_) first_beyond_ = f;
    greatest_h_ = std::max(greatest_h_, apart.position.max);
    removed_otherwise_ = apart.alive_in_one;
  }
  bool beyond() const { return first_beyond_.has_value(); }
  void report(Trial& trial) const {
    trial.rms_h = rms_h_;
    trial.greatest_rms_h = rms_h_.empty() ? 0 : *std::max_element(rms_h_.begin(), rms_h_.end());
    trial.first_beyond = first_beyond_;
    trial.greatest_h = greatest_h_;
    trial.removed_otherwise = removed_otherwise_;
  }
  Course& course() { return course_; }

 private:
  const Setup& setup_;
  const Course& answer_;
  double allowed_;
  Course course_;
  std::vector<double> rms_h_;
  std::optional<std::size_t> first_beyond_;
  double greatest_h_ = 0;
  int64_t removed_otherwise_ = 0;
};

class Tuner {
 public:
  explicit Tuner(const TuneOptions& options);
  int run();

 private:
  std::unique_ptr<Backend> backend_for(const Configuration& configuration) const {
    BackendChoice choice = options_.backend;
    choice.rotation = configuration.rotation;
    return make_backend(choice);
  }
  Staged staged(const Configuration& configuration, const Backend& backend) const {
    return {configuration.scene, options_.scene, options_.frames};
  }
  bool is_given(const Configuration& configuration) const { return configuration == given_; }
  // From the answer as it is known: what is left of the tolerance.
  double allowed() const { return options_.tolerance - answer_->known_to_h(); }
  SearchSpace space() const;
  Trial measure(const Configuration& configuration, std::optional<double> limit) const;
  std::string text_of(const Configuration& configuration) const;

  // The text of the scene, read back and run by a fresh backend: every oracle and every expectation of the scene, and
  // the distance from an answer that the search has not seen.
  struct Verified {
    Trial trial;
    int64_t verdicts = 0;
    std::string failure;  // empty: it holds
  };
  Verified verify(const Configuration& configuration, const std::string& text) const;

  // Taken in turns, so that what the machine does meanwhile falls on both; and anew, because the least of many figures
  // is too good.
  struct InTurns {
    Times given, found;
  };
  InTurns time_in_turns(const Configuration& found) const;

  struct Found {
    std::size_t trial = 0;
    std::string text;  // of the scene
    Verified verified;
    InTurns times;
  };
  // The cheapest that holds when it is verified and, timed again, is still cheaper than what was given.
  std::optional<Found> take_cheapest(const std::vector<Trial>& trials);

  void print_answer() const;
  void print(const std::vector<Trial>& trials) const;
  void print(const Found& found, const Configuration& configuration) const;
  json json_of_answer() const;
  json json_of(const Trial& trial) const;

  const TuneOptions& options_;
  std::string path_;  // of the scene that is written
  Configuration given_;
  std::optional<Answer> answer_;
  std::size_t searched_level_ = 0;  // of the answer, from which trials are measured
  json document_;
};

// Throws InputError if two of the three files are one.
std::string path_to_write(const TuneOptions& options) {
  namespace fs = std::filesystem;
  const fs::path path = options.write.empty() ? fs::path(options.scene).stem().string() + "_tuned.json" : options.write;
  const auto same = [](const fs::path& a, const fs::path& b) {
    std::error_code error;
    return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
  };
  const auto refuse = [](const char* option, const fs::path& file, const char* what) {
    throw InputError("command line", option, fmt::format("'{}' is {}", file.string(), what), "give another name");
  };
  if (same(path, options.scene)) refuse("--write", path, "the scene that is tuned");
  if (!options.json.empty() && same(options.json, options.scene)) {
    refuse("--json", options.json, "the scene that is tuned");
  }
  if (!options.json.empty() && same(options.json, path)) refuse("--json", path, "the scene that is written");
  return path.string();
}

Tuner::Tuner(const TuneOptions& options)
    : options_(options), path_(path_to_write(options)), given_{io::read_scene(options.scene), ""} {
  if (given_.scene.step.solver != Solver::implicit) {
    throw InputError(options.scene, "step.solver",
                     "'published' has no answer that it comes closer to: its stiffness depends on the number of "
                     "iterations and substeps",
                     "use \"implicit\" with a stiffness");
  }
  if (!std::isfinite(options.tolerance)) {
    throw InputError("command line", "--tolerance", "it is not a number", "give a length in h, such as 0.05");
  }
  // Whatever is wrong with the choice of a backend, or with the scene, is found out now.
  require_timed_backend(options.backend.name);
  make_backend(options.backend);
  if (Staged(given_.scene, options.scene, options.frames).frame_count() == 0) {
    throw InputError(options.scene, "frame.count", "the scene has no frame, so nothing happens that could be compared",
                     "give a number of frames, a blade, or a grip that ends");
  }
  if (options.backend.name != "reference") given_.rotation = rotation_of(options.backend);
}

SearchSpace Tuner::space() const {
  SearchSpace space;
  const int32_t given = given_.scene.step.substeps;
  space.substeps = substeps_to_try(given, std::max(Answer::kMostSubsteps / 4, given));
  space.most_iterations = std::max(64, given_.scene.step.iterations);
  if (options_.backend.name != "reference") {
    for (const std::string& rotation : sound_rotations()) {
      if (rotation != given_.rotation) space.rotations.push_back(rotation);
    }
  }
  space.nothing_removed = answer_->nothing_removed();
  space.may_resize = !given_.scene.expect.clusters.has_value();
  // A scene that counts the skin's shells looks at it.
  space.may_drop_skin = options_.without_skin && !given_.scene.expect.shells_at_end;
  return space;
}

double seconds_per_frame(Backend& backend, const Staged& staged) {
  return staged.run(backend, {}) / static_cast<double>(staged.frame_count());
}

Trial Tuner::measure(const Configuration& configuration, std::optional<double> limit) const {
  Trial trial;
  trial.configuration = configuration;
  const bool to_the_end = options_.full || is_given(configuration);
  const std::unique_ptr<Backend> backend = backend_for(configuration);
  std::optional<Staged> scene;
  try {
    scene.emplace(staged(configuration, *backend));
  } catch (const InputError& error) {  // such as a blade that few substeps cannot follow
    if (is_given(configuration)) throw;
    trial.outcome = Outcome::refused;
    trial.why = error.what();
    return trial;
  }
  const auto frames = static_cast<int64_t>(answer_->course().frames.size());
  const bool other_schedule = scene->frame_count() != frames;
  if (other_schedule) {
    trial.outcome = Outcome::schedule;
    trial.why = fmt::format("{} frames, the answer has {}", scene->frame_count(), frames);
    if (!to_the_end) return trial;
  }
  Comparison comparison(scene->setup(), answer_->course(), allowed());
  bool given_up = false;
  scene->run(*backend, [&](double seconds) {
    comparison.add(backend->snapshot().front());
    if (to_the_end) return true;
    // What is dearer by its first run may be a little less so by its median.
    const bool dearer = limit && seconds > 1.5 * *limit * static_cast<double>(frames);
    given_up = comparison.beyond() || dearer;
    if (given_up) trial.outcome = comparison.beyond() ? Outcome::over : Outcome::dearer;
    return !given_up;
  });
  comparison.report(trial);
  if (given_up) {
    trial.why = fmt::format("given up in frame {} of {}", trial.rms_h.size() - 1, frames);
    return trial;
  }
  comparison.course().stroke_end = scene->stroke_end();
  if (!other_schedule) {
    trial.why = other_parts(answer_->course(), comparison.course());
    trial.outcome = !trial.why.empty() ? Outcome::topology : comparison.beyond() ? Outcome::over : Outcome::within;
  }
  if (trial.outcome == Outcome::within || to_the_end) {
    std::vector<double> samples;
    for (int repeat = 0; repeat < options_.repeats; ++repeat) samples.push_back(seconds_per_frame(*backend, *scene));
    trial.frame = times_of(samples);
  }
  return trial;
}

std::string Tuner::text_of(const Configuration& configuration) const {
  namespace fs = std::filesystem;
  Scene scene = configuration.scene;
  if (scene.body.mesh && fs::path(scene.body.mesh->file).is_relative()) {
    // Named from where the new scene lies, whatever links lead there.
    const fs::path file = fs::canonical(fs::path(options_.scene).parent_path() / scene.body.mesh->file);
    std::error_code none;
    const fs::path near = fs::proximate(file, fs::canonical(fs::absolute(path_).parent_path()), none);
    scene.body.mesh->file = (none ? file : near).string();
  }
  return io::write_scene(scene);
}

Tuner::Verified Tuner::verify(const Configuration& configuration, const std::string& text) const {
  Verified verified;
  verified.trial.configuration = configuration;
  const Scene scene = io::parse_scene(text, path_);
  const std::unique_ptr<Backend> backend = backend_for(configuration);
  const Staged staged(scene, path_, options_.frames);
  harness::FrameRunner runner(*backend, {staged.setup()}, {staged.start()});
  // What a scene expects is of all of it; but isolation that it expects fails no verdict in a part of it either.
  Expectations expected = scene.expect;
  if (options_.frames) {
    expected = {};
    if (scene.expect.isolated_clusters && scene.expect.isolated_clusters->low >= 1) {
      expected.isolated_clusters = scene.expect.isolated_clusters;
    }
  }
  harness::SceneJudge judge(staged.setup(), expected, options_.backend.name, runner.states().front());
  Comparison comparison(staged.setup(), answer_->course(), allowed());
  for (int64_t frame = 0; frame < staged.frame_count(); ++frame) {
    staged.for_parts_of(frame, [&] { runner.run_frame([&](const harness::Moment& moment) { judge.see(moment); }); });
    comparison.add(*runner.states().front());
  }
  for (Verdict& verdict : runner.take_broken_contracts()) judge.add(std::move(verdict));
  judge.finish();
  comparison.report(verified.trial);
  comparison.course().stroke_end = staged.stroke_end();
  verified.verdicts = static_cast<int64_t>(judge.verdicts().size());
  if (answer_->course().frames.size() != comparison.course().frames.size()) {
    verified.failure = "it has another number of frames than a finer answer";
    verified.trial.outcome = Outcome::schedule;
  } else if (verified.failure = other_parts(answer_->course(), comparison.course()); !verified.failure.empty()) {
    verified.trial.outcome = Outcome::topology;
  } else if (comparison.beyond()) {
    verified.failure = fmt::format("it is {:.2g} h from a finer answer, known to {:.2g} h",
                                   verified.trial.greatest_rms_h, answer_->known_to_h());
    verified.trial.outcome = Outcome::over;
  } else {
    verified.trial.outcome = Outcome::within;
  }
  for (const Verdict& verdict : judge.verdicts()) {
    if (!verified.failure.empty()) break;
    if (verdict.holds || judge.is_expected_failure(verdict)) continue;
    verified.failure = fmt::format("{} fails in frame {}: {}", verdict.property, verdict.frame, verdict.witness.text);
  }
  return verified;
}

void Tuner::print_answer() const {
  fmt::print("the answer: {}\n", options_.answer == "limit" ? "the limit of short time steps"
                                                            : "the scene's own substeps, each solved until converged");
  for (const Level& level : answer_->levels()) {
    fmt::print("  reference, {} × {}{}\n", level.substeps, level.iterations,
               level.apart_h ? fmt::format(": {:.2g} h from the one before", *level.apart_h) : "");
  }
  std::fflush(stdout);
}

void Tuner::print(const std::vector<Trial>& trials) const {
  Table table({"substeps × iterations", "acceleration", "RMS h", "max h", "removed otherwise", "ms a frame", "of given",
               "outcome", "else"});
  const double given = trials.front().frame.median;
  for (const Trial& trial : trials) {
    const StepParameters& step = trial.configuration.scene.step;
    const bool timed = trial.frame.count > 0;
    std::string other = differences(trial.configuration, given_);
    if (!trial.why.empty()) other += (other.empty() ? "" : "; ") + trial.why;
    table.add({fmt::format("{} × {}", step.substeps, step.iterations), name_of(step.acceleration),
               fmt::format("{:.2g}", trial.greatest_rms_h), fmt::format("{:.2g}", trial.greatest_h),
               fmt::format("{}", trial.removed_otherwise),
               timed ? fmt::format("{:.3f}", 1e3 * trial.frame.median) : "-",
               timed ? fmt::format("{:.2f}", trial.frame.median / given) : "-", name_of(trial.outcome), other});
  }
  fmt::print("\n{}", table.text());
}

json Tuner::json_of(const Trial& trial) const {
  const Scene& scene = trial.configuration.scene;
  json rms = json::array();
  for (const double value : trial.rms_h) rms.push_back(json_number(value));
  return {{"substeps", scene.step.substeps},
          {"iterations", scene.step.iterations},
          {"acceleration", name_of(scene.step.acceleration)},
          {"rotation", trial.configuration.rotation.empty() ? json(nullptr) : json(trial.configuration.rotation)},
          {"differences", differences(trial.configuration, given_)},
          {"outcome", name_of(trial.outcome)},
          {"why", trial.why},
          {"rms_h", json_number(trial.greatest_rms_h)},
          {"max_h", json_number(trial.greatest_h)},
          {"rms_h_by_frame", rms},
          {"removed_otherwise", trial.removed_otherwise},
          {"seconds_per_frame", to_json(trial.frame)}};
}

json Tuner::json_of_answer() const {
  json levels = json::array();
  for (const Level& level : answer_->levels()) {
    levels.push_back({{"substeps", level.substeps},
                      {"iterations", level.iterations},
                      {"apart_h", level.apart_h ? json_number(*level.apart_h) : json(nullptr)}});
  }
  return {{"kind", options_.answer}, {"levels", levels}, {"searched_level", searched_level_}};
}

Tuner::InTurns Tuner::time_in_turns(const Configuration& found) const {
  std::vector<double> before, after;
  for (int repeat = 0; repeat < options_.repeats; ++repeat) {
    for (const bool given : {true, false}) {
      const Configuration& timed = given ? given_ : found;
      const std::unique_ptr<Backend> backend = backend_for(timed);
      (given ? before : after).push_back(seconds_per_frame(*backend, staged(timed, *backend)));
    }
  }
  return {times_of(before), times_of(after)};
}

std::optional<Tuner::Found> Tuner::take_cheapest(const std::vector<Trial>& trials) {
  const auto leave = [&](std::size_t index, const std::string& why) {
    const StepParameters& step = trials[index].configuration.scene.step;
    fmt::print("{} × {}, acceleration {}, is not taken: {}\n", step.substeps, step.iterations,
               name_of(step.acceleration), why);
    document_["left"].push_back({{"trial", index}, {"why", why}});
  };
  std::optional<Found> given;  // if it holds
  if (trials.front().outcome == Outcome::within) {
    Found found{0, text_of(given_), {}, {}};
    found.verified = verify(given_, found.text);
    if (found.verified.failure.empty()) given = std::move(found);
  }
  for (const std::size_t index : by_cost(trials)) {
    const Configuration& configuration = trials[index].configuration;
    if (index == 0) {
      if (given) break;
      leave(index, "it is not within when it is verified");
      continue;
    }
    Found found{index, text_of(configuration), {}, {}};
    found.verified = verify(configuration, found.text);
    if (!found.verified.failure.empty()) {
      leave(index, found.verified.failure);
      continue;
    }
    found.times = time_in_turns(configuration);
    if (given && found.times.found.median > (1 - kCheaper) * found.times.given.median) {
      leave(index, "timed again it is no cheaper than what was given");
      continue;
    }
    return found;
  }
  if (given) given->times = {trials.front().frame, trials.front().frame};
  return given;
}

void Tuner::print(const Found& found, const Configuration& configuration) const {
  const StepParameters& step = configuration.scene.step;
  const auto& [given, tuned] = found.times;
  const std::string other = differences(configuration, given_);
  if (found.trial == 0) {
    fmt::print(
        "\nfound: nothing that is cheaper; the scene as it was given is within the tolerance\n"
        "  {:.3f} ms a frame ({:.3f} to {:.3f})\n",
        1e3 * given.median, 1e3 * given.min, 1e3 * given.max);
  } else {
    const double ratio = given.median / tuned.median;
    fmt::print(
        "\nfound: {} × {}, acceleration {}{}\n"
        "  {:.3f} ms a frame ({:.3f} to {:.3f}), as given {:.3f} ({:.3f} to {:.3f}): {}\n",
        step.substeps, step.iterations, name_of(step.acceleration), other.empty() ? "" : ", " + other,
        1e3 * tuned.median, 1e3 * tuned.min, 1e3 * tuned.max, 1e3 * given.median, 1e3 * given.min, 1e3 * given.max,
        ratio >= 1 ? fmt::format("{:.2f} times cheaper", ratio)
                   : fmt::format("{:.2f} times as dear, and what was given is not within", 1 / ratio));
  }
  fmt::print(
      "  verified: RMS {:.2g} h, max {:.2g} h from the reference's {} × {}, {:.2g} h from the one before; "
      "{} verdicts hold\nwrote {}\n",
      found.verified.trial.greatest_rms_h, found.verified.trial.greatest_h, answer_->levels().back().substeps,
      answer_->levels().back().iterations, answer_->known_to_h(), found.verified.verdicts, path_);
  if (configuration.rotation != given_.rotation) {
    fmt::print("  rotations are no part of a scene: run it with --rotation {}\n", configuration.rotation);
  }
}

int Tuner::run() {
  require_writable(options_.json);
  require_writable(path_);
  json& document = document_;
  document = begin_report("tune", options_.backend.name);
  const auto finish = [&](int status) {
    document["complete"] = true;
    write_report(options_.json, document);
    if (!options_.json.empty()) fmt::print("wrote {}\n", options_.json);
    return status;
  };
  fmt::print("scene {}: {}\n", given_.scene.name, given_.scene.description);
  if (options_.without_skin && given_.scene.expect.shells_at_end) {
    fmt::print("--without-skin does nothing: the scene expects shells of its skin\n");
  }
  document["scene"] = options_.scene;
  document["tolerance_h"] = options_.tolerance;
  document["repeats"] = options_.repeats;
  document["frames"] = options_.frames ? json(*options_.frames) : json(nullptr);
  document["full"] = options_.full;
  document["without_skin"] = options_.without_skin;
  document["trials"] = json::array();
  document["left"] = json::array();
  document["found"] = nullptr;

  const AnswerKind kind = options_.answer == "limit" ? AnswerKind::limit : AnswerKind::substeps;
  answer_.emplace(kind, given_.scene, options_.scene, options_.frames, kUnknownShare * options_.tolerance);
  searched_level_ = answer_->levels().size() - 1;
  print_answer();
  document["answer"] = json_of_answer();
  if (!(allowed() > 0)) {
    fmt::print(
        "the answer is known to {:.2g} h only, so nothing can be said to be within {:g} h of it.\n"
        "  Give a greater tolerance{}.\n",
        answer_->known_to_h(), options_.tolerance,
        kind == AnswerKind::limit ? ", fewer --frames, or --answer substeps, which takes the scene's time step as given"
                                  : " or fewer --frames");
    return finish(1);
  }

  // Written after each, so that what has been measured is kept if a later one fails.
  const std::vector<Trial> trials =
      search(given_, space(), [&](const Configuration& configuration, std::optional<double> limit) {
        Trial trial = measure(configuration, limit);
        document["trials"].push_back(json_of(trial));
        write_report(options_.json, document);
        return trial;
      });
  print(trials);
  if (by_cost(trials).empty()) {
    fmt::print("none of {} configurations is within {:g} h of the answer, itself known to {:.2g} h\n", trials.size(),
               options_.tolerance, answer_->known_to_h());
    return finish(1);
  }

  answer_->refine();
  document["answer"] = json_of_answer();
  const std::optional<Found> found = take_cheapest(trials);
  if (!found) {
    fmt::print("none of the configurations that seemed to be within {:g} h holds when it is verified\n",
               options_.tolerance);
    return finish(1);
  }
  io::AtomicFile file(path_);
  io::write_text(file.temporary(), found->text);
  file.commit();
  print(*found, trials[found->trial].configuration);
  if (options_.frames) {
    fmt::print("  the scene was written whole, and looked at for {} frames only\n", *options_.frames);
  }
  document["found"] = {{"trial", found->trial},
                       {"verified", json_of(found->verified.trial)},
                       {"verdicts", found->verified.verdicts},
                       {"seconds_per_frame", to_json(found->times.found)},
                       {"seconds_per_frame_as_given", to_json(found->times.given)},
                       {"times_cheaper", found->times.given.median / found->times.found.median}};
  return finish(0);
}

}  // namespace

int tune(const TuneOptions& options) { return Tuner(options).run(); }

}  // namespace cutproof::cli
