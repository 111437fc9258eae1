#include "tuning/tune.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/error.h"
#include "model/io/json_number.h"
#include "model/io/scene_io.h"
#include "tuning/search.h"
#include "tuning/tuned_scene.h"

namespace cutproof::tuning {

namespace {

using nlohmann::json;

// The reference solution is refined until this part of the tolerance is left for what is not known of it, if it can be.
constexpr double kUnknownShare = 0.25;

// Methods that fail on no hard case (accuracy.md, Rotations). Another might be within the tolerance on this scene and
// fail on the next cut.
const std::vector<std::string>& sound_rotations() {
  static const std::vector<std::string> names = {"newton", "jacobi4", "svd"};
  return names;
}

// Whatever is wrong with the choice of a backend, or with the scene, is found out here.
Measuring prepare(const TuneOptions& options) {
  Measuring measuring{options.scene,  options.backend,   {io::read_scene(options.scene), ""},
                      options.frames, options.tolerance, options.full,
                      options.repeats};
  const Scene& scene = measuring.given.scene;
  if (scene.step.solver != Solver::implicit) {
    throw InputError(options.scene, "step.solver",
                     "'published' has no solution that it comes closer to: its stiffness depends on the number of "
                     "iterations and substeps",
                     "use \"implicit\" with a stiffness");
  }
  if (!std::isfinite(options.tolerance)) {
    throw InputError("command line", "--tolerance", "it is not a number", "give a length in h, such as 0.05");
  }
  const harness::BackendDescriptor& backend = benchmarks::require_timed_backend(options.backend.name);
  static_cast<void>(harness::make_backend(options.backend));
  if (PreparedScene(scene, options.scene, options.frames).frame_count() == 0) {
    throw InputError(options.scene, "frame.count", "the scene has no frame, so nothing happens that could be compared",
                     "give a number of frames, a blade, or a grip that ends");
  }
  if (backend.takes_kernel_options) measuring.given.rotation = harness::rotation_of(options.backend);
  return measuring;
}

SearchSpace space_of(const Measuring& measuring, const TuneOptions& options, const ReferenceSolution& reference) {
  SearchSpace space;
  const Scene& scene = measuring.given.scene;
  const int32_t given = scene.step.substeps;
  space.substeps = substeps_to_try(given, std::max(ReferenceSolution::kMostSubsteps / 4, given));
  space.most_iterations = std::max(64, scene.step.iterations);
  if (harness::described_backend(options.backend.name).takes_kernel_options) {
    for (const std::string& rotation : sound_rotations()) {
      if (rotation != measuring.given.rotation) space.rotations.push_back(rotation);
    }
  }
  space.nothing_removed = reference.nothing_removed();
  space.may_resize = !scene.expect.clusters.has_value();
  // A scene that counts the skin's shells looks at it.
  space.may_drop_skin = options.without_skin && !scene.expect.shells_at_end;
  return space;
}

// The cheapest that holds when it is verified and, timed again, is still cheaper than what was given.
std::optional<TuneResult::Found> take_cheapest(const Measuring& measuring, const ReferenceSolution& reference,
                                               const std::vector<Trial>& trials, const std::string& path,
                                               const std::function<void(std::size_t, const std::string&)>& leave) {
  using Found = TuneResult::Found;
  const auto verified = [&](std::size_t index) {
    const Configuration& configuration = trials[index].configuration;
    Found found{index, tuned_scene_text(configuration, measuring.source, path), {}, {}};
    found.verified = verify(measuring, reference, configuration, found.text, path);
    return found;
  };
  std::optional<Found> given;  // if it holds
  if (trials.front().outcome == Outcome::within) {
    Found found = verified(0);
    if (found.verified.failure.empty()) given = std::move(found);
  }
  for (const std::size_t index : by_cost(trials)) {
    if (index == 0) {
      if (given) break;
      leave(index, "it is not within when it is verified");
      continue;
    }
    Found found = verified(index);
    if (!found.verified.failure.empty()) {
      leave(index, found.verified.failure);
      continue;
    }
    found.times = time_in_turns(measuring, trials[index].configuration);
    if (given && found.times.found.median > (1 - kCheaper) * found.times.given.median) {
      leave(index, "timed again it is no cheaper than what was given");
      continue;
    }
    return found;
  }
  if (given) given->times = {trials.front().frame, trials.front().frame};
  return given;
}

}  // namespace

const char* name_of(ReferenceKind kind) { return kind == ReferenceKind::limit ? "limit" : "substeps"; }

json to_json(const TuneResult& result) {
  const TuneOptions& options = result.options;
  json document = benchmarks::begin_document(result.provenance, result.conclusion.has_value());
  document["scene"] = options.scene;
  document["tolerance_h"] = options.tolerance;
  document["repeats"] = options.repeats;
  document["frames"] = options.frames ? json(*options.frames) : json(nullptr);
  document["full"] = options.full;
  document["without_skin"] = options.without_skin;
  json levels = json::array();
  for (const RefinementLevel& level : result.levels) {
    levels.push_back({{"substeps", level.substeps},
                      {"iterations", level.iterations},
                      {"apart_h", level.apart_h ? json_number(*level.apart_h) : json(nullptr)}});
  }
  document["reference"] = {
      {"kind", name_of(options.reference)}, {"levels", levels}, {"searched_level", result.searched_level}};
  document["trials"] = json::array();
  for (const Trial& trial : result.trials) document["trials"].push_back(to_json(trial, result.given));
  document["left"] = json::array();
  for (const auto& [trial, why] : result.not_taken) document["left"].push_back({{"trial", trial}, {"why", why}});
  document["found"] = nullptr;
  if (result.found) {
    const auto& [trial, text, verified, times] = *result.found;
    document["found"] = {{"trial", trial},
                         {"verified", to_json(verified.trial, result.given)},
                         {"verdicts", verified.verdicts},
                         {"seconds_per_frame", benchmarks::to_json(times.found)},
                         {"seconds_per_frame_as_given", benchmarks::to_json(times.given)},
                         {"times_cheaper", times.given.median / times.found.median}};
  }
  return document;
}

TuneResult run_tune(const TuneOptions& options, const TuneProgress& progress) {
  const Measuring measuring = prepare(options);
  TuneResult result;
  result.provenance = benchmarks::provenance_of("tune", options.backend.name);
  result.options = options;
  result.given = measuring.given;
  result.skin_is_expected = options.without_skin && measuring.given.scene.expect.shells_at_end;
  progress(result, TuneStep::begun);
  const auto conclude = [&](TuneResult::Conclusion conclusion) {
    result.conclusion = conclusion;
    progress(result, TuneStep::concluded);
    return result;
  };

  ReferenceSolution reference(options.reference, measuring.given.scene, options.scene, options.frames,
                              kUnknownShare * options.tolerance);
  const auto note_reference = [&] {
    result.levels = reference.levels();
    result.known_to_h = reference.known_to_h();
  };
  note_reference();
  result.searched_level = result.levels.size() - 1;
  progress(result, TuneStep::reference_known);
  if (!(measuring.allowed(reference) > 0)) return conclude(TuneResult::Conclusion::reference_unknown);

  search(measuring.given, space_of(measuring, options, reference),
         [&](const Configuration& configuration, std::optional<double> limit) {
           result.trials.push_back(measure(measuring, reference, configuration, limit));
           progress(result, TuneStep::trial);
           return result.trials.back();
         });
  progress(result, TuneStep::searched);
  if (by_cost(result.trials).empty()) return conclude(TuneResult::Conclusion::none_within);

  reference.refine();
  note_reference();
  std::optional<TuneResult::Found> found =
      take_cheapest(measuring, reference, result.trials, options.write, [&](std::size_t trial, const std::string& why) {
        result.not_taken.push_back({trial, why});
        progress(result, TuneStep::not_taken);
      });
  if (!found) return conclude(TuneResult::Conclusion::none_verified);
  write_tuned_scene(found->text, options.write);
  result.found = std::move(found);
  return conclude(TuneResult::Conclusion::found);
}

}  // namespace cutproof::tuning
