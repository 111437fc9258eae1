#include "tuning/tune.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <map>
#include <set>
#include <utility>

#include "benchmarks/report.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/json_number.h"
#include "model/io/scene_io.h"
#include "tuning/search.h"
#include "tuning/verification.h"

namespace cutproof::tuning {

namespace {

using nlohmann::json;

// The reference solution is refined, if possible, until its error is this part of the tolerance.
constexpr double kUnknownShare = 0.25;

// Throws for a bad choice of backend and for a bad scene.
Measuring prepare(const TuneOptions& options) {
  Measuring measuring{options, {io::read_scene(options.scene, options.changes)}};
  const Scene& scene = measuring.given.scene;
  if (scene.step.solver != Solver::implicit) {
    throw InputError(options.scene, "step.solver",
                     "'published' has no solution to converge to: its stiffness depends on iterations and substeps",
                     "use \"implicit\" with a stiffness");
  }
  if (!std::isfinite(options.tolerance)) {
    throw InputError("command line", "--tolerance", "it is not a number", "give a length in h, such as 0.05");
  }
  benchmarks::require_timed_backend(options.backend.name);
  static_cast<void>(harness::make_backend(options.backend));
  const benchmarks::PreparedScene prepared(scene, options.scene, options.frames);
  if (prepared.frame_count() == 0) {
    throw InputError(options.scene, "frame.count", "the scene has no frame to compare",
                     "give a number of frames, a blade, or a grip that ends");
  }
  measuring.built = prepared.report();
  return measuring;
}

// At most an eighth of the limit's finest level, whose number would be compared with itself.
std::vector<int32_t> searched_substeps(int32_t given) {
  return substeps_to_try(given, std::max(ReferenceSolution::kMostSubsteps / 8, given));
}

SearchSpace space_of(const Measuring& measuring, const TuneOptions& options, const ReferenceSolution& reference) {
  SearchSpace space;
  const Scene& scene = measuring.given.scene;
  const int32_t given = scene.step.substeps;
  space.substeps = searched_substeps(given);
  space.most_iterations = std::max(64, scene.step.iterations);
  space.nothing_removed = reference.nothing_removed();
  if (options.full) {
    space.followed_to = std::max(kFrontTolerances.back() - reference.known_to_h(), kFrontTolerances.back() / 2);
  }
  space.may_resize = !scene.expect.clusters.has_value();
  // An expectation of the skin's shells needs the skin.
  space.may_drop_skin = options.without_skin && !scene.expect.shells_at_end;
  return space;
}

// Times all possible points of the front in turns. Their times may make others possible points. Then all are timed
// again, because a round of the new ones alone would have other conditions.
void time_front(const Measuring& measuring, std::vector<Trial>& trials) {
  std::set<std::size_t> timed;
  while (true) {
    std::set<std::size_t> wanted = timed;
    for (const std::size_t index : may_be_points(trials, measuring.asked.tolerance)) wanted.insert(index);
    if (wanted == timed) return;
    timed = std::move(wanted);
    std::vector<Configuration> configurations;
    for (const std::size_t index : timed) configurations.push_back(trials[index].configuration);
    const std::vector<benchmarks::Times> times = times_in_turns(measuring, configurations);
    auto time = times.begin();
    for (const std::size_t index : timed) trials[index].frame = *time++;
  }
}

// A verified trial, as the scene to be written.
struct Found {
  std::size_t trial = 0;
  std::string text;
  Verified verified;
  benchmarks::Times as_given, tuned;  // seconds per frame, in turns
};

using JudgedRuns = std::map<std::size_t, JudgedRun>;  // by trial

// Refines the reference solution. Meanwhile judges the runs that are verified first, the given scene and the cheapest,
// which do not depend on it.
JudgedRuns judge_while_refining(const Measuring& measuring, ReferenceSolution& reference,
                                const std::vector<Trial>& trials) {
  std::map<std::size_t, std::future<JudgedRun>> judging;
  for (const std::size_t index : {std::size_t{0}, by_cost(trials).front()}) {
    if (trials[index].outcome != Outcome::within || judging.contains(index)) continue;
    judging.emplace(index, std::async(std::launch::async, [&, index] {
                      return judged_run(measuring, trials[index].configuration, measuring.asked.write);
                    }));
  }
  reference.refine();
  JudgedRuns judged;
  for (auto& [index, run] : judging) judged.emplace(index, run.get());
  return judged;
}

// The cheapest trial that holds in verification and, timed again, is still cheaper than the given scene. `judged`:
// earlier judged runs.
std::optional<Found> take_cheapest(const Measuring& measuring, const ReferenceSolution& reference,
                                   const std::vector<Trial>& trials, JudgedRuns judged,
                                   const std::function<void(std::size_t, const std::string&)>& leave) {
  const auto verified = [&](std::size_t index) {
    const auto before = judged.find(index);
    JudgedRun run = before != judged.end() ? std::move(before->second)
                                           : judged_run(measuring, trials[index].configuration, measuring.asked.write);
    Found found{index, run.text, {}, {}, {}};
    found.verified = verify(measuring, reference, std::move(run));
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
      leave(index, "verification rejects it");
      continue;
    }
    Found found = verified(index);
    if (!found.verified.failure.empty()) {
      leave(index, found.verified.failure);
      continue;
    }
    const auto times = times_in_turns(measuring, {measuring.given, trials[index].configuration});
    found.as_given = times[0];
    found.tuned = times[1];
    if (given && found.tuned.median > (1 - kCheaper) * found.as_given.median) {
      leave(index, "timed again it is no cheaper than the given scene");
      continue;
    }
    return found;
  }
  if (given) given->as_given = given->tuned = trials.front().frame;
  return given;
}

json levels_json(ReferenceKind kind, const ReferenceSolution& reference) {
  json levels = json::array();
  for (const RefinementLevel& level : reference.levels()) {
    levels.push_back({{"substeps", level.substeps}, {"iterations", nullptr}, {"apart_h", json_number(level.apart_h)}});
    if (level.apart_h) {
      levels.back()["removed_in_another_frame"] = level.events.in_another_frame;
      levels.back()["alive_in_one"] = level.events.alive_in_one;
      levels.back()["clusters_in_one"] = level.events.clusters_in_one;
    }
    if (kind == ReferenceKind::limit) {
      levels.back()["order"] = json_number(observed_order(reference.levels(), levels.size() - 1));
    }
    if (level.iterations) {
      levels.back()["iterations"] = *level.iterations;
    } else {
      levels.back()["solved"] = {{"substeps", level.solved.substeps},
                                 {"by_iteration", level.solved.by_iteration},
                                 {"unsolved", level.solved.unsolved}};
    }
  }
  return levels;
}

json front_json(const std::vector<FrontPoint>& points) {
  json front = json::array();
  for (const FrontPoint& point : points) {
    front.push_back({{"tolerance_h", point.tolerance}, {"trial", nullptr}});
    if (point.trial) front.back()["trial"] = *point.trial;
  }
  return front;
}

}  // namespace

double part_searched(const json& so_far, const Scene& given) {
  // Substeps ascend, with and without acceleration. Then the cheapest is varied, which takes about a fifth of that
  // time.
  constexpr double kOfSteps = 0.85;
  const std::vector<int32_t> substeps = searched_substeps(given.step.substeps);
  const json& trials = so_far.at("trials");
  if (trials.size() < 2) return 0;  // the given scene
  const json& last = trials.back();
  const auto at = std::lower_bound(substeps.begin(), substeps.end(), last.at("substeps").get<int32_t>());
  const double half = last.at("acceleration") == "none" ? 0.25 : 0.75;
  return kOfSteps * (static_cast<double>(at - substeps.begin()) + half) / static_cast<double>(substeps.size());
}

bool run_tune(const TuneOptions& options, const TuneProgress& progress) {
  const Measuring measuring = prepare(options);
  json document = benchmarks::begin_document("tune", options.backend.name);
  document.update({{"scene", options.scene},
                   {"tolerance_h", options.tolerance},
                   {"repeats", options.repeats},
                   {"frames", options.frames ? json(*options.frames) : json(nullptr)},
                   {"full", options.full},
                   {"without_skin", options.without_skin},
                   {"trials", json::array()},
                   {"front", json::array()},
                   {"left", json::array()},
                   {"found", nullptr}});
  const auto show = [&](TuneStep step) { progress(step, document, measuring.given.scene, measuring.built); };
  const auto conclude = [&](TuneStep conclusion) {
    document["complete"] = true;
    show(conclusion);
    return conclusion == TuneStep::found;
  };
  show(TuneStep::begun);
  try {
    ReferenceSolution reference(options.reference, measuring.given.scene, options.scene, options.frames,
                                kUnknownShare * options.tolerance, options.stop_asked);
    document["reference"] = {{"kind", options.reference == ReferenceKind::limit ? "limit" : "substeps"},
                             {"levels", levels_json(options.reference, reference)},
                             {"known_h", json_number(reference.known_to_h())},
                             {"known_text", known_to(reference.levels())},
                             {"searched_level", reference.levels().size() - 1}};
    show(TuneStep::reference_known);
    if (!(measuring.allowed(reference) > 0)) return conclude(TuneStep::reference_unknown);

    std::vector<Trial> trials;  // outside search(), because they are needed during the search
    search(measuring.given, space_of(measuring, options, reference),
           [&](const Configuration& configuration, std::optional<double> limit) {
             trials.push_back(measure(measuring, reference, configuration, limit, trials));
             document["trials"].push_back(to_json(trials.back(), measuring.given));
             document["front"] = front_json(front(trials, options.tolerance, options.full, reference.known_to_h()));
             show(TuneStep::trial);
             return trials.back();
           });
    show(TuneStep::tried);
    if (options.full) {
      time_front(measuring, trials);
      for (std::size_t k = 0; k < trials.size(); ++k) document["trials"][k] = to_json(trials[k], measuring.given);
      document["front"] = front_json(front(trials, options.tolerance, true, reference.known_to_h()));
    }
    show(TuneStep::searched);
    if (by_cost(trials).empty()) return conclude(TuneStep::none_within);

    JudgedRuns judged = judge_while_refining(measuring, reference, trials);
    document["reference"]["levels"] = levels_json(options.reference, reference);
    document["reference"]["known_h"] = json_number(reference.known_to_h());
    document["reference"]["known_text"] = known_to(reference.levels());
    const std::optional<Found> found =
        take_cheapest(measuring, reference, trials, std::move(judged), [&](std::size_t trial, const std::string& why) {
          document["left"].push_back({{"trial", trial}, {"why", why}});
          show(TuneStep::not_taken);
        });
    if (!found) return conclude(TuneStep::none_verified);
    io::write_text(options.write, found->text);
    document["found"] = {{"trial", found->trial},
                         {"verified", to_json(found->verified.trial, measuring.given)},
                         {"verdicts", found->verified.verdicts},
                         {"seconds_per_frame", benchmarks::to_json(found->tuned)},
                         {"seconds_per_frame_as_given", benchmarks::to_json(found->as_given)},
                         {"times_cheaper", found->as_given.median / found->tuned.median}};
    return conclude(TuneStep::found);
  } catch (const Stopped&) {
    show(TuneStep::stopped);
    return false;
  }
}

}  // namespace cutproof::tuning
